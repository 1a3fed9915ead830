#include "estimators/baselines/magnetic_stochastic/distribution_fit.h"

#include <Eigen/Cholesky>

#include "core/parallel.h"

namespace lodestone {

namespace {

/// Least share of the samples that must carry the weight (their effective number), so that d (d + 3) / 2 moments are
/// determined by several samples each.
constexpr double kLeastEffectiveShare = 0.1;

constexpr std::size_t kSamplesAPiece = 64;

/// Weights exp(power · log_weights) of sum 1; the power is 1, or halved until enough samples carry the weight.
Eigen::VectorXd tempered_weights(const Eigen::VectorXd& log_weights) {
  for (double power = 1.0;; power *= 0.5) {
    Eigen::VectorXd weights = (power * (log_weights.array() - log_weights.maxCoeff())).exp();
    weights /= weights.sum();
    // Not a number, from a state that is not: returned, and judged by the health of the estimate.
    const bool too_few = 1.0 / weights.squaredNorm() < kLeastEffectiveShare * static_cast<double>(weights.size());
    if (!too_few) return weights;
  }
}

}  // namespace

FittedDistribution fit_distribution(const Eigen::MatrixXd& root,
                                    const std::function<double(const Eigen::VectorXd&)>& cost, int samples,
                                    int iterations, RandomStream& random) {
  // In units of the prior's sigmas: u ~ N(0, 1), n = root u.
  const Eigen::Index dimensions = root.cols();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(dimensions);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(dimensions, dimensions);
  const Eigen::Index count = samples + samples % 2;
  Eigen::MatrixXd standard(dimensions, count);
  Eigen::VectorXd log_weights(count);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const Eigen::MatrixXd step = covariance.llt().matrixL();
    for (Eigen::Index i = 0; i < count; i += 2) {
      for (Eigen::Index k = 0; k < dimensions; ++k) standard(k, i) = random.normal();
      standard.col(i + 1) = -standard.col(i);
    }
    const Eigen::MatrixXd points = (step * standard).colwise() + mean;
    parallel_for(
        Eigen::Index{0}, count,
        [&](Eigen::Index i) {
          // ln(prior · exp(−cost) / proposal), without constants.
          log_weights[i] =
              0.5 * (standard.col(i).squaredNorm() - points.col(i).squaredNorm()) - cost(root * points.col(i));
        },
        kSamplesAPiece);
    const Eigen::VectorXd weights = tempered_weights(log_weights);
    mean = points * weights;
    const Eigen::MatrixXd centred = points.colwise() - mean;
    covariance = centred * weights.asDiagonal() * centred.transpose();
  }
  return {root * mean, root * covariance * root.transpose()};
}

}  // namespace lodestone
