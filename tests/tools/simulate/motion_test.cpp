#include "tools/simulate/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/simulate/inertial_simulator.h"
#include "tools/simulate/route.h"

namespace lodestone::simulation {
namespace {

Sequence winding_sequence() {
  Sequence sequence;
  sequence.waypoints = {{0, 0}, {12, 0}, {12, 9}, {25, 12}, {30, 2}};
  sequence.speed = {{0.0, 1.0}, {20.0, 2.5}};
  return sequence;
}

Motion winding_motion() {
  return {plan_drive(winding_sequence()), 0.2, FloorOptions{}, 5};
}

TEST(Motion, DerivativesAreThoseOfThePose) {
  const Motion motion = winding_motion();
  constexpr double h = 1e-4;
  for (double t = 1.0; t < motion.duration() - 1.0; t += 0.1937) {
    const MotionSample before = motion.at(t - h), now = motion.at(t), after = motion.at(t + h);
    const Vector3 velocity = (after.T_map_imu.position - before.T_map_imu.position) / (2 * h);
    const Vector3 acceleration = (after.velocity - before.velocity) / (2 * h);
    const Vector3 rate = so3::log(before.T_map_imu.rotation.conjugate() * after.T_map_imu.rotation) / (2 * h);
    EXPECT_LT((velocity - now.velocity).norm(), 1e-5) << t;
    EXPECT_LT((acceleration - now.acceleration).norm(), 1e-3) << t;
    EXPECT_LT((rate - now.angular_velocity).norm(), 1e-4) << t;
  }
}

TEST(Motion, ThirdDerivativeHasNoSteps) {
  const Motion motion = winding_motion();
  constexpr double h = 1e-5;
  const auto jerk = [&](double t) {
    return ((motion.at(t + h).acceleration - motion.at(t - h).acceleration) / (2 * h)).eval();
  };
  // Across a knot (every plan_step_s), the jerk changes as little as within an interval.
  for (int k = 200; k < 900; k += 7) {
    const double knot = k * plan_step_s;
    const double across = (jerk(knot + 2 * h) - jerk(knot - 2 * h)).norm();
    const double within = (jerk(knot + 0.4 * plan_step_s + 2 * h) - jerk(knot + 0.4 * plan_step_s - 2 * h)).norm();
    EXPECT_LT(across, 10.0 * within + 1.0) << knot;
  }
}

TEST(Motion, IdealImuIntegratesToTheTruth) {
  const Motion motion = winding_motion();
  constexpr double gravity = 9.80665;
  // At 200 Hz, the remaining error is that of the trapezoid: a velocity of dt²/12 times the jerk at the start.
  for (const auto [dt, tolerance] : {std::pair{0.001, 1e-4}, std::pair{0.005, 2e-3}})
    for (const double start : {0.0, 4.0, 12.0}) {
      const MotionSample first = motion.at(start);
      Pose pose = first.T_map_imu;
      Vector3 velocity = first.velocity;
      for (int k = 0; k < std::lround(10.0 / dt); ++k) {
        const double t = start + k * dt;
        const ImuSample a = ideal_imu(motion, t, gravity), b = ideal_imu(motion, t + dt, gravity);
        const Quaternion next = pose.rotation * so3::exp(0.5 * dt * (a.angular_velocity + b.angular_velocity));
        const Vector3 acceleration =
            0.5 * (pose.rotation * a.linear_acceleration + next * b.linear_acceleration) - gravity * Vector3::UnitZ();
        pose.position += velocity * dt + 0.5 * acceleration * dt * dt;
        velocity += acceleration * dt;
        pose.rotation = next.normalized();
      }
      EXPECT_LT((pose.position - motion.pose_at(start + 10.0).position).norm(), tolerance) << start;
    }
}

TEST(Motion, StandsStillBeforeItDrives) {
  const Motion motion = winding_motion();
  for (double t = 0.0; t < 1.2; t += 0.1) {
    EXPECT_LT(motion.at(t).velocity.norm(), 1e-9) << t;
    EXPECT_LT(motion.at(t).angular_velocity.norm(), 1e-9) << t;
  }
}

TEST(Motion, KeepsTheLimitsOfItsSequence) {
  const Sequence sequence = winding_sequence();
  const Motion motion = winding_motion();
  double fastest = 0.0;
  for (double t = 0.0; t < motion.duration(); t += 0.01) fastest = std::max(fastest, motion.at(t).velocity.norm());
  EXPECT_GT(fastest, 1.9);
  EXPECT_LT(fastest, 2.6);
  const auto plan = plan_drive(sequence);
  for (std::size_t i = 1; i < plan.size(); ++i) {
    EXPECT_LT(std::abs(plan[i].heading - plan[i - 1].heading) / plan_step_s, 1.1 * sequence.max_yaw_rate_rad_s);
    EXPECT_LT(std::abs(plan[i].speed - plan[i - 1].speed) / plan_step_s, 1.6 * sequence.acceleration_m_s2);
  }
}

TEST(Route, KeepsOffCornersAndOnLegs) {
  const Route route({{0, 0}, {10, 0}, {10, 10}}, 2.0);
  EXPECT_LT((route.at(0.0).position - Eigen::Vector2d(0, 0)).norm(), 0.02);
  EXPECT_LT((route.at(5.0).position - Eigen::Vector2d(5, 0)).norm(), 0.02);
  EXPECT_NEAR(route.at(0.5 * route.length()).heading, M_PI / 4, 0.01);
  EXPECT_NEAR(route.at(0.5 * route.length()).curvature, 0.5, 0.05);
  EXPECT_LT((route.at(route.length()).position - Eigen::Vector2d(10, 10)).norm(), 0.02);
  EXPECT_LT((route.at(route.length() + 1.0).position - Eigen::Vector2d(10, 11)).norm(), 0.02);
}

TEST(Survey, DrivesEveryLaneForwardsAndBackwards) {
  Sequence sequence;
  sequence.waypoints = {{0, 0}, {30, 0}};
  sequence.speed = {{0.0, 1.0}};
  SurveyOptions survey;
  survey.lateral_offsets_m = {-0.5, 0.0, 0.5};
  const auto plan = plan_survey(sequence, survey);
  std::vector<int> at_lane(3, 0);
  bool forwards = false, backwards = false;
  double previous = plan.front().heading;
  for (const PlannedPose& pose : plan) {
    for (int lane = 0; lane < 3; ++lane)
      at_lane[lane] += std::abs(pose.position.y() - survey.lateral_offsets_m[lane]) < 0.01;
    forwards |= pose.speed > 1.0;
    backwards |= pose.speed < -1.0;
    EXPECT_LT(std::abs(pose.heading - previous), 0.05);
    previous = pose.heading;
  }
  EXPECT_TRUE(forwards);
  EXPECT_TRUE(backwards);
  for (const int count : at_lane) EXPECT_GT(count * plan_step_s, 10.0);
}

}  // namespace
}  // namespace lodestone::simulation
