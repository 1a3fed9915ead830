#include "tools/check/rotation_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/geometry/pose.h"

namespace lodestone {
namespace {

/// A turn rate about the robot's vertical that differs from all its time shifts.
double turn_rate(double seconds) {
  return 0.5 * std::sin(1.3 * seconds) + 0.3 * std::sin(2.9 * seconds + 1.0);
}

struct Motion {
  Trajectory lidar;
  std::vector<ImuSample> imu;
};

/// Twenty seconds. The IMU's stamps are late by `offset_s`; its readings are `scale` times the true ones, with a bias
/// that changes by a step. `sway_rad_s`: rate of pitch and roll.
Motion make_motion(const Quaternion& R_imu_lidar, double offset_s, double scale, const Vector3& bias_step,
                   double sway_rad_s = 0.0) {
  Motion motion;
  const auto rate_at = [&](double seconds) {
    return Vector3(sway_rad_s * std::sin(5.1 * seconds), sway_rad_s * std::sin(7.3 * seconds + 0.4),
                   turn_rate(seconds));
  };
  Quaternion R_map_imu = Quaternion::Identity();
  for (int i = 0; i < 4000; ++i) {
    const double seconds = 0.005 * i;
    R_map_imu = R_map_imu * so3::exp(0.005 * rate_at(seconds + 0.0025));
    const Vector3 bias = Vector3(0.01, -0.02, 0.005) + (i > 2000 ? bias_step : Vector3(Vector3::Zero()));
    motion.imu.push_back({from_seconds(seconds + offset_s), scale * rate_at(seconds) + bias, Vector3::Zero()});
    if (i % 20 == 19)
      motion.lidar.push_back({from_seconds(seconds + 0.005), {R_map_imu * R_imu_lidar, Vector3::Zero()}});
  }
  return motion;
}

const Quaternion kMount = so3::exp(Vector3(0.4, -0.2, 0.9));

TEST(RotationFit, FindsOffsetAndScaleWhateverTheMounting) {
  for (const double offset_s : {0.0, 0.037, -0.8}) {
    for (const double scale : {1.0, 180.0 / M_PI}) {
      const Motion motion = make_motion(kMount, offset_s, scale, Vector3::Zero());
      const auto fit = fit_rotation(motion.lidar, motion.imu, Quaternion::Identity());
      ASSERT_TRUE(fit);
      EXPECT_TRUE(fit->axis_observable());
      EXPECT_NEAR(fit->offset_s, offset_s, 0.003);
      EXPECT_NEAR(fit->scale / scale, 1.0, 0.01);
      EXPECT_LE(fit->scale_least, fit->scale);
      EXPECT_GE(fit->scale_most, fit->scale);
    }
  }
}

TEST(RotationFit, TellsAMountingFromItsInverse) {
  const Motion motion = make_motion(kMount, 0.0, 1.0, Vector3::Zero());
  const auto right = fit_rotation(motion.lidar, motion.imu, kMount);
  const auto inverted = fit_rotation(motion.lidar, motion.imu, kMount.conjugate());
  ASSERT_TRUE(right && inverted);
  EXPECT_LT(right->axis_error_rad, 0.01);
  EXPECT_GT(right->axis_error_inverse_rad, 0.3);
  EXPECT_GT(inverted->axis_error_rad, 0.3);
  EXPECT_LT(inverted->axis_error_inverse_rad, 0.01);
}

/// Turns about one axis contain no information on the rotation about this axis; pitch and roll above the noise do.
TEST(RotationFit, TellsTheTurnAboutTheAxisByTheSwayAlone) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 3e-4);  // rad per scan
  const double half_turn = 3.0;
  const Quaternion wrong = so3::exp(Vector3(0, 0, half_turn)) * kMount;
  for (const double sway_rad_s : {0.0, 0.02}) {
    double squares = 0.0, sigma = 0.0;
    constexpr int runs = 20;
    for (int run = 0; run < runs; ++run) {
      Motion motion = make_motion(kMount, 0.0, 1.0, Vector3::Zero(), sway_rad_s);
      Quaternion drift = Quaternion::Identity();
      for (StampedPose& pose : motion.lidar) {
        drift = drift * so3::exp(Vector3(noise(random), noise(random), noise(random)));
        pose.pose.rotation = pose.pose.rotation * drift;
      }
      const auto fit = fit_rotation(motion.lidar, motion.imu, wrong);
      ASSERT_TRUE(fit && fit->axis_observable());
      EXPECT_LT(fit->axis_error_rad, 0.02);
      EXPECT_EQ(fit->turn_observable(), sway_rad_s > 0.0) << fit->turn_sigma_rad;
      squares += std::pow(std::abs(fit->turn_about_axis_rad) - half_turn, 2) / runs;
      sigma += fit->turn_sigma_rad / runs;
      const double off_rad = so3::log(fit->R_imu_lidar * kMount.conjugate()).norm();
      EXPECT_EQ(off_rad<0.1, sway_rad_s> 0.0);
    }
    if (sway_rad_s == 0.0) continue;
    EXPECT_NEAR(std::sqrt(squares) / sigma, 1.0, 0.4) << "of a sigma of " << sigma;
  }
}

TEST(RotationFit, FindsAStepOfTheBias) {
  const Vector3 step(0.01, 0.03, -0.02);
  const auto fit =
      fit_rotation(make_motion(kMount, 0.0, 1.0, step).lidar, make_motion(kMount, 0.0, 1.0, step).imu, kMount);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->bias_step_rad_s, step.norm(), 0.005);
  EXPECT_NEAR(to_seconds(fit->bias_step_time), 10.0, 0.3);
}

TEST(RotationFit, SaysThatItCannotTellWhereNothingTurns) {
  Motion motion = make_motion(kMount, 0.0, 1.0, Vector3::Zero());
  for (StampedPose& pose : motion.lidar) pose.pose.rotation.setIdentity();
  const auto fit = fit_rotation(motion.lidar, motion.imu, kMount);
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->axis_observable());
  motion.lidar.resize(5);
  EXPECT_FALSE(fit_rotation(motion.lidar, motion.imu, kMount));
}

}  // namespace
}  // namespace lodestone
