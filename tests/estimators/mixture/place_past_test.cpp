#include "estimators/mixture/place_past.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/imu/propagation.h"
#include "estimators/mixture/magnetic_mixture.h"
#include "tests/estimators/baselines/striped_field.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

/// A component with two magnetometers and a covariance without structure.
PlaceComponent place() {
  PlaceComponent result;
  result.state.T_map_imu = {so3::exp({0.05, -0.1, 1.2}), {3.0, -2.0, 0.4}};
  result.state.velocity = {1.0, -0.5, 0.1};
  result.offsets_ut = Eigen::VectorXd::Constant(6, 1.5);
  RandomStream random(3, "covariance of a component");
  Eigen::MatrixXd root(23, 23);
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal();
  Eigen::VectorXd sigmas(23);
  sigmas << Vector3::Constant(1e-3), Vector3::Constant(0.02), Vector3::Constant(0.02), Vector3::Constant(1e-4),
      Vector3::Constant(1e-3), Eigen::Vector2d::Constant(1e-4), Eigen::VectorXd::Constant(6, 0.2);
  result.covariance = sigmas.asDiagonal() * (root * root.transpose() / 23.0) * sigmas.asDiagonal();
  result.parent = 5;
  return result;
}

Preintegration increment() {
  std::vector<ImuSample> imu;
  for (int i = 0; i <= 40; ++i) imu.push_back({from_seconds(0.0025 * i), {0.3, 0.2, 1.0}, {1.0, -0.5, 9.6}});
  return {imu, Vector3::Zero(), Vector3::Zero(), ImuNoise{}};
}

// Nothing was learned after the prediction: nothing changes.
TEST(SmoothedBefore, KeepsAPlaceWithoutNews) {
  const PlaceComponent before = place();
  PlaceComponent after = before;
  Eigen::MatrixXd crossed;
  predict_place(increment(), ImuNoise{}, after, crossed);
  const PlaceComponent found = smoothed_before(before, increment(), after, ImuNoise{});
  EXPECT_LT(step_between(before, found).norm(), 1e-9);
  EXPECT_LT((found.covariance - before.covariance).norm(), 1e-9 * before.covariance.norm());
  EXPECT_EQ(found.parent, before.parent);
}

// A measurement of the state after, once as an update of both states together, once by filter and smoother.
TEST(SmoothedBefore, IsTheJointEstimate) {
  const PlaceComponent before = place();
  PlaceComponent predicted = before;
  Eigen::MatrixXd crossed;
  predict_place(increment(), ImuNoise{}, predicted, crossed);
  const Eigen::Index n = before.covariance.cols();
  Eigen::MatrixXd joint(2 * n, 2 * n);
  joint << before.covariance, crossed.transpose(), crossed, predicted.covariance;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(4, 2 * n);
  H.block<3, 3>(0, n + tangent::position).setIdentity();
  H(3, 2 * n - 1) = 1.0;
  const Eigen::Vector4d measured(0.003, -0.002, 0.001, 0.1);  // minus predicted
  const Eigen::Vector4d variances(1e-4, 1e-4, 1e-4, 0.01);
  const Eigen::MatrixXd innovation = H * joint * H.transpose() + Eigen::MatrixXd(variances.asDiagonal());
  const Eigen::MatrixXd gain = joint * H.transpose() * innovation.inverse();
  const Eigen::VectorXd step = gain * measured;
  const Eigen::MatrixXd expected = joint - gain * H * joint;

  PlaceComponent after = predicted;
  after.move(step.tail(n));
  after.covariance = expected.bottomRightCorner(n, n);
  const PlaceComponent found = smoothed_before(before, increment(), after, ImuNoise{});
  const Eigen::VectorXd sigmas = before.covariance.diagonal().cwiseSqrt();
  EXPECT_LT((step_between(before, found) - step.head(n)).cwiseQuotient(sigmas).norm(), 1e-3);
  const Eigen::MatrixXd difference = found.covariance - expected.topLeftCorner(n, n);
  EXPECT_LT(
      (sigmas.cwiseInverse().asDiagonal() * difference * sigmas.cwiseInverse().asDiagonal()).cwiseAbs().maxCoeff(),
      1e-6);
}

/// Squared error of the position in the plane, m², and per degree of freedom in its covariance; means.
struct PlanarAccuracy {
  double error_m2 = 0.0;
  double nees = 0.0;
  int count = 0;
  void add(const Estimate& one) {
    const Eigen::Vector2d error = (one.state.T_map_imu.position - StripedField::truth(one.time).position).head<2>();
    error_m2 += error.squaredNorm();
    nees += 0.5 * error.dot(one.covariance.block<2, 2>(3, 3).llt().solve(error));
    ++count;
  }
};

// Later readings make the past more accurate, and its covariance is still that of its errors.
TEST(MagneticMixture, SmoothsThePast) {
  PlanarAccuracy causal, best;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const StripedField stripes;
    EstimatorInput input = stripes.input;
    input.options.initial.position_sigma_m = 0.1;
    RandomStream random(seed, "initial pose");
    input.initial_pose.position.head<2>() += 0.1 * random.normal3().head<2>();
    input.initial_velocity += 0.05 * random.normal3();
    MagneticMixture estimator(input);
    Collector result;
    for (const ScanBundle& bundle : stripes.drive(9.0, seed)) estimator.process(bundle, result);
    estimator.finish(result);
    for (const Estimate& one : result.causal_estimates) causal.add(one);
    for (const Estimate& one : result.best_estimates) best.add(one);
  }
  std::printf("errors %.4f and %.4f m, NEES %.2f and %.2f\n", std::sqrt(causal.error_m2 / causal.count),
              std::sqrt(best.error_m2 / best.count), causal.nees / causal.count, best.nees / best.count);
  EXPECT_LT(best.error_m2, 0.5 * causal.error_m2);
  EXPECT_GT(best.nees / best.count, 0.3);
  EXPECT_LT(best.nees / best.count, 1.5);
}

}  // namespace
}  // namespace lodestone::testing
