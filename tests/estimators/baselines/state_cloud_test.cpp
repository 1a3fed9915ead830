#include "estimators/baselines/state_cloud.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/imu/propagation.h"
#include "core/random_stream.h"

namespace lodestone {
namespace {

Matrix17 cloud_covariance(RandomStream& random) {
  Matrix17 root;
  for (auto& value : root.reshaped()) value = 0.01 * random.normal();
  return root * root.transpose() + 1e-6 * Matrix17::Identity();
}

NavState driving_state() {
  NavState state;
  state.T_map_imu = {Quaternion(Eigen::AngleAxisd(0.4, Vector3::UnitZ())), {3.0, -2.0, 0.2}};
  state.velocity = {0.9, 0.3, 0.01};
  state.gyroscope_bias = {0.01, -0.02, 0.005};
  state.accelerometer_bias = {0.1, 0.05, -0.03};
  return state;
}

/// The state after a rigid motion of the map: a turn about the vertical and a shift.
NavState moved(const NavState& state, double angle_rad, const Vector3& shift) {
  const Quaternion turn(Eigen::AngleAxisd(angle_rad, Vector3::UnitZ()));
  NavState result = state;
  result.T_map_imu = {turn * state.T_map_imu.rotation, turn * state.T_map_imu.position + shift};
  result.velocity = turn * state.velocity;
  result.gravity = turn * state.gravity;
  return result;
}

std::vector<ImuSample> curved_drive() {
  std::vector<ImuSample> result;
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.005 * i;
    result.push_back(
        {from_seconds(t), {0.02 * std::sin(30.0 * t), 0.01, 0.5 + t}, {0.3 + t, 0.5 * std::cos(20.0 * t), 9.81}});
  }
  return result;
}

TEST(StateCloud, EachStateAndItsTurnedCovarianceArePropagatedAsIfAlone) {
  RandomStream random(1, "covariance of a cloud");
  const NavState nominal = driving_state();
  StateCloud cloud(nominal, cloud_covariance(random));
  NavState other = moved(nominal, 2.0, {-5.0, 1.0, 0.0});
  other.gyroscope_bias.z() += 1e-3;
  other.accelerometer_bias.x() -= 1e-2;
  cloud.states.push_back({other, 0.0});
  // The covariance of the other state: each column turned, then each row.
  const auto turned_covariance = [&] {
    Matrix17 half;
    for (int i = 0; i < tangent::size; ++i)
      half.col(i) = cloud.turned(cloud.covariance().col(i), cloud.states[1].state);
    Matrix17 result;
    for (int i = 0; i < tangent::size; ++i)
      result.col(i) = cloud.turned(half.row(i).transpose(), cloud.states[1].state);
    return result;
  };
  Matrix17 alone = turned_covariance();
  const ImuNoise noise;
  const NavState expected = propagate(other, curved_drive(), noise, &alone);
  cloud.propagate(curved_drive(), noise);
  EXPECT_LT(cloud.states[1].state.boxminus(expected).norm(), 1e-6);
  EXPECT_LT(cloud.states[0].state.boxminus(cloud.nominal()).norm(), 1e-12);
  // The biases differ a little, so the covariances agree to first order.
  EXPECT_LT((turned_covariance() - alone).norm(), 1e-3 * alone.norm());
}

TEST(StateCloud, SamplingSplitsTheCovarianceIntoSpreadAndRest) {
  RandomStream random(2, "covariance of a cloud");
  const NavState nominal = driving_state();
  const Matrix17 covariance = cloud_covariance(random);
  for (const bool with_height : {false, true}) {
    StateCloud cloud(nominal, covariance);
    const StateCloud::Regression seen = field_regression(cloud, with_height);
    ASSERT_EQ(seen.dimensions(), with_height ? 4 : 3);
    cloud.replace_covariance(seen, Eigen::MatrixXd::Zero(seen.dimensions(), seen.dimensions()));
    EXPECT_LT((seen.seen * cloud.covariance()).norm(), 1e-12);
    // The law of total covariance, and its sample version.
    EXPECT_LT((seen.gain * seen.covariance * seen.gain.transpose() + cloud.covariance() - covariance).norm(), 1e-12);
    cloud.states.clear();
    constexpr int kSamples = 20000;
    for (int i = 0; i < kSamples; ++i) {
      Eigen::VectorXd standard(seen.dimensions());
      for (double& number : standard) number = random.normal();
      cloud.states.push_back({nominal.boxplus(seen.gain * (seen.root * standard)), 0.0});
    }
    const std::vector<double> weights = cloud.weights();
    EXPECT_LT(cloud.mean(weights).boxminus(nominal).norm(), 0.05 * std::sqrt(covariance.trace()));
    const Matrix17 total = cloud.spread(weights, nominal) + cloud.covariance();
    EXPECT_LT((total - covariance).norm(), 0.03 * covariance.norm());
  }
}

TEST(StateCloud, APosteriorOfTheSeenPartIsTheCovarianceOfAKalmanUpdate) {
  RandomStream random(3, "covariance of a cloud");
  const Matrix17 covariance = cloud_covariance(random);
  StateCloud cloud(driving_state(), covariance);
  const StateCloud::Regression seen = field_regression(cloud, false);
  const Matrix3 noise = 1e-4 * Matrix3::Identity();
  const Matrix3 posterior = seen.covariance - seen.covariance * (seen.covariance + noise).inverse() * seen.covariance;
  cloud.replace_covariance(seen, posterior);
  const Eigen::MatrixXd gain =
      covariance * seen.seen.transpose() * (seen.seen * covariance * seen.seen.transpose() + noise).inverse();
  const Matrix17 expected = covariance - gain * seen.seen * covariance;
  EXPECT_LT((cloud.covariance() - expected).norm(), 1e-10 * covariance.norm());
}

TEST(StateCloud, AMeasurementOfBodyVelocityUpdatesStatesOfAllHeadingsAlike) {
  RandomStream random(4, "covariance of a cloud");
  const NavState nominal = driving_state();
  StateCloud cloud(nominal, cloud_covariance(random));
  const double angle_rad = 1.3;
  const Vector3 shift(4.0, 0.0, 0.0);
  cloud.states.push_back({moved(nominal, angle_rad, shift), 0.0});
  const Vector3 measured(1.0, 0.0, 0.0);
  const auto residual = [&](const NavState& state) -> Eigen::VectorXd {
    return state.T_map_imu.rotation.conjugate() * state.velocity - measured;
  };
  Eigen::MatrixXd jacobian(3, tangent::size);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < tangent::size; ++i) {
    const Vector17 step = kStep * Vector17::Unit(i);
    jacobian.col(i) = (residual(nominal.boxplus(step)) - residual(nominal.boxplus(-step))) / (2.0 * kStep);
  }
  cloud.update(residual, jacobian, 1e-4 * Matrix3::Identity());
  EXPECT_LT(cloud.states[1].state.boxminus(moved(cloud.states[0].state, angle_rad, shift)).norm(), 1e-9);
  EXPECT_NEAR(cloud.states[0].log_weight, cloud.states[1].log_weight, 1e-9);
  EXPECT_LT(residual(cloud.nominal()).norm(), residual(nominal).norm());
}

}  // namespace
}  // namespace lodestone
