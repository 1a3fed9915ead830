#include "estimators/health/motion_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/estimators/health/estimates.h"

namespace lodestone {
namespace {

using testing::kStep_s;
using testing::with_sigma;

/// An estimate of the given step.
Estimate at(int step, double sigma_m, const Vector3& position, const Vector3& velocity) {
  Estimate estimate = with_sigma(sigma_m);
  estimate.time = from_seconds(kStep_s * step);
  estimate.state.T_map_imu.position = position;
  estimate.state.velocity = velocity;
  return estimate;
}

TEST(MotionCheck, PositionsThatMoveAsTheirVelocitiesSayAreNotApart) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.1);
  MotionCheck check;
  for (int k = 0; k < 1000; ++k) {
    const double t_s = kStep_s * k;
    const Vector3 position(5.0 * std::cos(0.2 * t_s) + noise(random), 5.0 * std::sin(0.2 * t_s), 0.0);
    check.add(at(k, 0.1, position, Vector3(-std::sin(0.2 * t_s), std::cos(0.2 * t_s), 0.0)));
    EXPECT_EQ(check.apart_m(), 0.0) << k;
  }
}

/// Each step of 0.1 m is within the sigma of 0.2 m.
TEST(MotionCheck, PositionsThatArePutBackAtEachStepAreApartAsFarAsTheRobotDrove) {
  MotionCheck check;
  int first_apart = 0;
  for (int k = 0; k <= 300; ++k) {
    check.add(at(k, 0.2, Vector3::Zero(), Vector3::UnitX()));
    if (check.apart_m() == 0.0) {
      first_apart = k + 1;
    } else {
      EXPECT_NEAR(check.apart_m(), std::min(kStep_s * k, 10.0), 1e-9);
    }
  }
  EXPECT_NEAR(kStep_s * first_apart, 4.0 * std::sqrt(2.0) * 0.2, kStep_s);
}

TEST(MotionCheck, AScanASecondIsEnoughAlsoIfItsStampsJitter) {
  constexpr int kSteps = 11;  // 1.1 s
  MotionCheck check;
  for (int k = 0; k < 9; ++k) check.add(at(kSteps * k, 0.2, Vector3::Zero(), Vector3::UnitX()));
  EXPECT_NEAR(check.apart_m(), 8.0 * kSteps * kStep_s, 1e-9);
}

TEST(MotionCheck, WhatACovarianceOfTheTimeAllowsIsNotApart) {
  MotionCheck check;
  check.add(at(0, 2.0, Vector3::Zero(), Vector3::Zero()));
  for (int k = 1; k < 50; ++k) check.add(at(k, 0.05, Vector3(6.0, 0.0, 0.0), Vector3::Zero()));
  EXPECT_EQ(check.apart_m(), 0.0);
  check.add(at(50, 0.05, Vector3(12.0, 0.0, 0.0), Vector3::Zero()));
  EXPECT_NEAR(check.apart_m(), 12.0, 1e-9);
}

TEST(MotionCheck, BeginsAnewAfterAGap) {
  MotionCheck check;
  check.add(at(0, 0.05, Vector3::Zero(), Vector3::Zero()));
  check.add(at(20, 0.05, Vector3(9.0, 0.0, 0.0), Vector3::Zero()));
  EXPECT_EQ(check.apart_m(), 0.0);
  check.add(at(21, 0.05, Vector3(18.0, 0.0, 0.0), Vector3::Zero()));
  EXPECT_NEAR(check.apart_m(), 9.0, 1e-9);
  check.restart();
  EXPECT_EQ(check.apart_m(), 0.0);
}

}  // namespace
}  // namespace lodestone
