#include "estimators/baselines/ndt/pose_filter.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace lodestone {
namespace {

constexpr double kGravity_m_s2 = 9.80665;
constexpr double kStep_s = 0.005;
constexpr int kStepsAScan = 20;

InitialState start_at(const Pose& pose, const Vector3& velocity = Vector3::Zero()) {
  return initial_state(pose, velocity, kGravity_m_s2, InitialOptions{});
}

/// Readings of an IMU that moves with a constant velocity and does not turn.
ImuInterval uniform_motion(const Quaternion& rotation) {
  return {kStep_s, Vector3::Zero(), rotation.conjugate() * Vector3(0.0, 0.0, kGravity_m_s2)};
}

Quaternion attitude(double roll, double pitch, double yaw) {
  return Quaternion(Eigen::AngleAxisd(yaw, Vector3::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3::UnitY()) *
                    Eigen::AngleAxisd(roll, Vector3::UnitX()));
}

TEST(PoseFilter, BeginsWithTheGivenStateAndItsCovarianceAtAnyAttitude) {
  InitialOptions options;
  options.rotation_sigma_deg = 2.0;
  options.position_sigma_m = 0.3;
  for (const double yaw : {0.0, 0.5, 2.0, 3.1, -1.7}) {
    const Pose pose{attitude(0.2, -0.1, yaw), Vector3(3.0, -2.0, 1.0)};
    const InitialState start = initial_state(pose, Vector3(1.0, 0.5, 0.0), kGravity_m_s2, options);
    const PoseFilter filter(start);
    EXPECT_LT(filter.state().boxminus(start.state).norm(), 1e-12);
    EXPECT_TRUE(filter.pose_covariance().isApprox(start.covariance.topLeftCorner<6, 6>(), 1e-12));
  }
}

/// With the authors' noise, the sigma points of the quaternion are up to its length away, which costs 0.2° and 3 mm.
TEST(PoseFilter, AtRestConvergesToTheMeasuredPoseAtAnyAttitude) {
  double largest_rad = 0.0;
  double largest_m = 0.0;
  for (int degrees = -180; degrees < 180; degrees += 7) {
    const Pose truth{attitude(0.05, -0.03, degrees * M_PI / 180.0), Vector3(1.0, 2.0, 0.3)};
    PoseFilter filter(start_at(truth));
    for (int scan = 0; scan < 100; ++scan) {
      for (int i = 0; i < kStepsAScan; ++i) filter.predict(uniform_motion(truth.rotation), kStep_s);
      filter.correct(truth);
    }
    const Vector6 error = filter.state().T_map_imu.boxminus(truth);
    largest_rad = std::max(largest_rad, error.head<3>().norm());
    largest_m = std::max(largest_m, error.tail<3>().norm());
  }
  EXPECT_LT(largest_rad, 0.005);
  EXPECT_LT(largest_m, 0.005);
}

TEST(PoseFilter, FollowsTheImuBetweenMeasurements) {
  const Pose begin{attitude(0.0, 0.0, 0.7), Vector3(1.0, 2.0, 0.3)};
  const Vector3 velocity(0.8, -0.3, 0.1);
  PoseFilter filter(start_at(begin, velocity));
  const ImuInterval imu = uniform_motion(begin.rotation);
  for (int i = 0; i < kStepsAScan; ++i) filter.predict(imu, kStep_s);
  const NavState state = filter.state();
  EXPECT_LT((state.T_map_imu.position - begin.position - kStepsAScan * kStep_s * velocity).norm(), 0.005);
  EXPECT_LT(state.T_map_imu.boxminus(begin).head<3>().norm(), 0.01);
  EXPECT_GT(filter.pose_covariance()(3, 3), start_at(begin).covariance(3, 3));
}

/// A robot moves as the filter assumes, and is measured with the errors that the filter assumes.
TEST(PoseFilter, CovarianceIsThatOfTheErrors) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  const auto noise = [&](double variance) {
    Vector3 result;
    for (double& value : result) value = std::sqrt(variance) * normal(generator);
    return result;
  };
  double nees = 0.0;
  double position_nees = 0.0;
  int count = 0;
  for (int run = 0; run < 20; ++run) {
    Pose truth{attitude(0.0, 0.0, 0.3 * run), Vector3(1.0, 2.0, 0.3)};
    Vector3 velocity = Vector3::Zero();
    PoseFilter filter(start_at(truth));
    for (int scan = 0; scan < 30; ++scan) {
      for (int i = 0; i < kStepsAScan; ++i) {
        filter.predict(uniform_motion(truth.rotation), kStep_s);
        truth.position += kStep_s * velocity + noise(1.0 * kStep_s);
        velocity += noise(1.0 * kStep_s);
        // A turn is twice the change of the quaternion.
        truth.rotation = (truth.rotation * so3::exp(noise(4.0 * 0.5 * kStep_s))).normalized();
      }
      Vector6 error;
      error << noise(4.0 * 0.001), noise(0.01);
      filter.correct(truth.boxplus(error));
      if (scan < 5) continue;
      const Vector6 off = filter.state().T_map_imu.boxminus(truth);
      const Matrix6 covariance = filter.pose_covariance();
      nees += off.dot(covariance.inverse() * off) / 6.0;
      position_nees += off.tail<3>().dot(covariance.bottomRightCorner<3, 3>().inverse() * off.tail<3>()) / 3.0;
      ++count;
    }
  }
  EXPECT_NEAR(nees / count, 1.0, 0.15);
  EXPECT_NEAR(position_nees / count, 1.0, 0.15);
}

}  // namespace
}  // namespace lodestone
