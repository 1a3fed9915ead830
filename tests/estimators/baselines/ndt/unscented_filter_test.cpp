#include "estimators/baselines/ndt/unscented_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

namespace lodestone {
namespace {

Eigen::MatrixXd random_matrix(int rows, int columns, std::mt19937_64& generator) {
  Eigen::MatrixXd result(rows, columns);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) result(i, j) = uniform(generator);
  }
  return result;
}

Eigen::MatrixXd random_covariance(int size, std::mt19937_64& generator) {
  const Eigen::MatrixXd root = random_matrix(size, size, generator);
  return root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(size, size);
}

GaussianState random_state(int size, std::mt19937_64& generator) {
  return {random_matrix(size, 1, generator), random_covariance(size, generator)};
}

TEST(UnscentedFilter, SigmaPointsHaveTheMeanAndTheCovarianceOfTheState) {
  std::mt19937_64 generator(1);
  for (const int n : {1, 3, 16}) {
    const GaussianState state = random_state(n, generator);
    const Eigen::MatrixXd points = sigma_points(state);
    const Eigen::VectorXd weights = sigma_weights(n);
    EXPECT_NEAR(weights.sum(), 1.0, 1e-14);
    const Eigen::VectorXd mean = points * weights;
    EXPECT_TRUE(mean.isApprox(state.mean, 1e-12));
    const Eigen::MatrixXd deviations = points.colwise() - mean;
    EXPECT_TRUE((deviations * weights.asDiagonal() * deviations.transpose()).isApprox(state.covariance, 1e-12));
  }
}

TEST(UnscentedFilter, IsTheKalmanFilterOfALinearSystem) {
  std::mt19937_64 generator(2);
  constexpr int n = 5;
  constexpr int m = 3;
  GaussianState state = random_state(n, generator);
  Eigen::VectorXd mean = state.mean;
  Eigen::MatrixXd covariance = state.covariance;
  for (int step = 0; step < 20; ++step) {
    const Eigen::MatrixXd transition = random_matrix(n, n, generator);
    const Eigen::MatrixXd observation = random_matrix(m, n, generator);
    const Eigen::MatrixXd process_noise = random_covariance(n, generator);
    const Eigen::MatrixXd measurement_noise = random_covariance(m, generator);
    const Eigen::VectorXd z = random_matrix(m, 1, generator);
    state = unscented_prediction(
        state, [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return transition * x; }, process_noise);
    state = unscented_update(
        state, [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return observation * x; }, z, measurement_noise);

    mean = transition * mean;
    covariance = transition * covariance * transition.transpose() + process_noise;
    const Eigen::MatrixXd innovation = observation * covariance * observation.transpose() + measurement_noise;
    const Eigen::MatrixXd gain = covariance * observation.transpose() * innovation.inverse();
    mean += gain * (z - observation * mean);
    covariance -= gain * observation * covariance;
    ASSERT_TRUE(state.mean.isApprox(mean, 1e-9)) << step;
    ASSERT_TRUE(state.covariance.isApprox(covariance, 1e-9)) << step;
  }
}

/// The mean of a quadratic function is exact: E[xᵀ A x] = mᵀ A m + tr(A P). A linearization has the first term only.
TEST(UnscentedFilter, KnowsTheMeanOfAQuadraticFunction) {
  std::mt19937_64 generator(3);
  const GaussianState state = random_state(4, generator);
  const Eigen::MatrixXd form = random_matrix(4, 4, generator);
  const auto quadratic = [&](const Eigen::VectorXd& x) {
    return Eigen::VectorXd(Eigen::VectorXd::Constant(1, x.dot(form * x)));
  };
  const GaussianState after = unscented_prediction(state, quadratic, Eigen::MatrixXd::Zero(1, 1));
  EXPECT_NEAR(after.mean[0], state.mean.dot(form * state.mean) + (form * state.covariance).trace(), 1e-12);
}

TEST(UnscentedFilter, WithoutAPositiveCovarianceTheStateIsNoNumber) {
  GaussianState state{Eigen::VectorXd::Zero(2), -Eigen::MatrixXd::Identity(2, 2)};
  EXPECT_FALSE(sigma_points(state).allFinite());
  const GaussianState after = unscented_prediction(
      state, [](const Eigen::VectorXd& x) { return x; }, Eigen::MatrixXd::Identity(2, 2));
  EXPECT_FALSE(after.mean.allFinite());
}

}  // namespace
}  // namespace lodestone
