#include "tools/simulate/displacement_field.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lodestone::simulation {
namespace {

TEST(DisplacementField, HasTheAskedRmsAndLength) {
  constexpr double rms = 0.02, length = 20.0;
  constexpr int seeds = 600;
  const Vector3 place(12.0, -7.0, 1.0), along = place + Vector3(length, 0, 0), far = place + Vector3(0, 3 * length, 0);
  double squares = 0.0, at_length = 0.0, far_away = 0.0, components = 0.0;
  for (int seed = 0; seed < seeds; ++seed) {
    const DisplacementField field(rms, length, seed, "test");
    const Vector3 d = field.at(place);
    squares += d.squaredNorm() / (3.0 * seeds);
    at_length += d.dot(field.at(along)) / (3.0 * seeds);
    far_away += d.dot(field.at(far)) / (3.0 * seeds);
    components += d.x() * d.y() / seeds;
  }
  // The kernel is rms² exp(−r² / (2 length²)).
  EXPECT_NEAR(std::sqrt(squares) / rms, 1.0, 0.06);
  EXPECT_NEAR(at_length / (rms * rms), std::exp(-0.5), 0.1);
  EXPECT_NEAR(far_away / (rms * rms), std::exp(-4.5), 0.1);
  EXPECT_NEAR(components / (rms * rms), 0.0, 0.15);
}

TEST(DisplacementField, GradientIsThatOfTheField) {
  const DisplacementField field(0.05, 8.0, 3, "test");
  const Vector3 place(3.0, 4.0, 0.5);
  const Matrix3 gradient = field.gradient(place);
  constexpr double step = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 offset = step * Vector3::Unit(axis);
    const Vector3 slope = (field.at(place + offset) - field.at(place - offset)) / (2.0 * step);
    EXPECT_LT((slope - gradient.col(axis)).norm(), 1e-8);
  }
}

TEST(DisplacementField, MovesAndTurnsARobotAsTheMapAroundIt) {
  const DisplacementField field(0.05, 20.0, 11, "test");
  const Pose pose{so3::exp(Vector3(0.01, -0.02, 2.0)), Vector3(30.0, -12.0, 0.2)};
  const Pose displaced = field.displaced(pose);
  EXPECT_EQ(displaced.position, pose.position + field.at(pose.position));
  // Objects within 2 m of the robot, seen from the displaced pose, agree with the map except for strain. Strain is as
  // large as the rotation (2 m of 20 m times 5 cm), and its mean over all directions is zero.
  Vector3 mean = Vector3::Zero(), mean_turn = Vector3::Zero();
  constexpr int directions = 72;
  for (int i = 0; i < directions; ++i) {
    const double angle = 2.0 * M_PI * i / directions;
    const Vector3 arm(2.0 * std::cos(angle), 2.0 * std::sin(angle), 0.0);
    const Vector3 mapped = pose * arm + field.at(pose * arm);
    const Vector3 error = displaced.inverse() * mapped - arm;
    EXPECT_LT(error.norm(), 0.03);
    mean += error / directions;
    mean_turn += arm.cross(error) / (4.0 * directions);
  }
  EXPECT_LT(mean.norm(), 2e-3);
  EXPECT_LT(std::abs(mean_turn.z()), 1e-4);  // rad: no rotation about the vertical remains
  EXPECT_EQ(DisplacementField{}.displaced(pose).position, pose.position);
}

}  // namespace
}  // namespace lodestone::simulation
