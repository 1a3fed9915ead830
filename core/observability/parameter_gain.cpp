#include "core/observability/parameter_gain.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace lodestone {

ParameterGain analyse_gain(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior_sigma, double threshold) {
  ParameterGain result;
  result.prior_sigma = prior_sigma;
  const Eigen::MatrixXd whitened = prior_sigma.asDiagonal() * information * prior_sigma.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(0.5 * (whitened + whitened.transpose()));
  result.directions = solver.eigenvectors();
  result.gain =
      solver.eigenvalues().unaryExpr([](double value) { return std::max(0.0, value) / (1.0 + std::max(0.0, value)); });
  result.hidden = (result.gain.array() < threshold).count();
  return result;
}

Eigen::VectorXd ParameterGain::hidden_share() const {
  return directions.leftCols(hidden).rowwise().squaredNorm();
}

double ParameterGain::hidden_share_of(const Eigen::VectorXd& pattern) const {
  return (directions.leftCols(hidden).transpose() * pattern).squaredNorm() / pattern.squaredNorm();
}

Eigen::MatrixXd ParameterGain::hidden_rows() const {
  return directions.leftCols(hidden).transpose() * prior_sigma.cwiseInverse().asDiagonal();
}

Eigen::MatrixXd ParameterGain::covariance() const {
  Eigen::VectorXd variance = (1.0 - gain.array()).matrix();
  variance.head(hidden).setOnes();
  return prior_sigma.asDiagonal() * directions * variance.asDiagonal() * directions.transpose() *
         prior_sigma.asDiagonal();
}

}  // namespace lodestone
