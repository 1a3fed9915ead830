#include "estimators/baselines/magnetic_stochastic/distribution_fit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lodestone {
namespace {

TEST(DistributionFit, OfAQuadraticCostIsTheKalmanUpdate) {
  Eigen::Matrix3d root;
  root << 0.3, 0.0, 0.0, 0.1, 0.5, 0.0, -0.05, 0.2, 0.02;
  const Eigen::Matrix3d prior = root * root.transpose();
  const Eigen::Matrix3d noise = Eigen::Vector3d(0.04, 0.01, 0.01).asDiagonal();
  const Eigen::Vector3d measured(0.4, -0.3, 0.03);
  const auto cost = [&](const Eigen::VectorXd& n) {
    const Eigen::Vector3d residual = n - measured;
    return 0.5 * residual.dot(noise.inverse() * residual);
  };
  RandomStream random(1, "fit");
  const FittedDistribution fitted = fit_distribution(root, cost, 4000, 5, random);
  const Eigen::Matrix3d gain = prior * (prior + noise).inverse();
  const Eigen::Matrix3d expected = prior - gain * prior;
  const Eigen::Vector3d difference = fitted.mean - gain * measured;
  // The mean is within four of its sigmas with 4000 samples, the covariance within 10 %.
  EXPECT_LT(difference.dot(expected.inverse() * difference), 3.0 * 16.0 / 4000.0);
  EXPECT_LT((fitted.covariance - expected).norm(), 0.1 * expected.norm());
}

TEST(DistributionFit, OfAHeavyTailedCostHasTheMomentsOfThePosterior) {
  const auto cost = [](const Eigen::VectorXd& n) { return 2.5 * std::log1p(std::pow((n[0] - 1.0) / 0.3, 2) / 4.0); };
  RandomStream random(2, "fit");
  const FittedDistribution fitted = fit_distribution(Eigen::MatrixXd::Constant(1, 1, 0.5), cost, 20000, 5, random);
  double sum = 0.0;
  double first = 0.0;
  double second = 0.0;
  for (double n = -4.0; n <= 4.0; n += 1e-3) {
    const double density = std::exp(-0.5 * n * n / 0.25 - cost(Eigen::VectorXd::Constant(1, n)));
    sum += density;
    first += density * n;
    second += density * n * n;
  }
  const double mean = first / sum;
  EXPECT_NEAR(fitted.mean[0], mean, 0.01);
  EXPECT_NEAR(fitted.covariance(0, 0), second / sum - mean * mean, 0.05 * fitted.covariance(0, 0));
}

TEST(DistributionFit, DoesNotCollapseIfTheCostIsFarNarrowerThanThePrior) {
  const auto cost = [](const Eigen::VectorXd& n) { return 0.5 * (n.array() - 1.5).matrix().squaredNorm() / 1e-4; };
  RandomStream random(3, "fit");
  const FittedDistribution fitted = fit_distribution(Eigen::MatrixXd::Identity(4, 4), cost, 400, 20, random);
  EXPECT_LT((fitted.mean.array() - 1.5).abs().maxCoeff(), 0.003);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(std::sqrt(fitted.covariance(i, i)), 0.01, 0.003) << i;
}

TEST(DistributionFit, EndsWithACostThatIsNotANumber) {
  RandomStream random(5, "fit");
  const auto cost = [](const Eigen::VectorXd&) { return std::nan(""); };
  EXPECT_FALSE(fit_distribution(Eigen::MatrixXd::Identity(3, 3), cost, 100, 2, random).mean.allFinite());
}

TEST(DistributionFit, WithoutACostKeepsThePrior) {
  RandomStream random(4, "fit");
  const Eigen::MatrixXd root = 0.1 * Eigen::MatrixXd::Identity(3, 3);
  const FittedDistribution fitted = fit_distribution(
      root, [](const Eigen::VectorXd&) { return 0.0; }, 4000, 4, random);
  EXPECT_LT(fitted.mean.norm(), 1e-2);
  EXPECT_LT((fitted.covariance - root * root.transpose()).norm(), 1e-3);
}

}  // namespace
}  // namespace lodestone
