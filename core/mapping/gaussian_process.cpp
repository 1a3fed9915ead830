#include "core/mapping/gaussian_process.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace lodestone {
namespace {

/// Squared distances, rows(a) × rows(b). From differences, because |a|² + |b|² − 2ab loses digits at large coordinates.
Eigen::MatrixXd squared_distances(const Eigen::ArrayX3d& a, const Eigen::ArrayX3d& b) {
  Eigen::MatrixXd result(a.rows(), b.rows());
  for (Eigen::Index j = 0; j < b.rows(); ++j) {
    result.col(j) =
        ((a.col(0) - b(j, 0)).square() + (a.col(1) - b(j, 1)).square() + (a.col(2) - b(j, 2)).square()).matrix();
  }
  return result;
}

/// Replaces squared distances by the field's part of the kernel.
void to_kernel(const KernelParameters& parameters, Eigen::MatrixXd& distances) {
  const double exponent = -0.5 / (parameters.length_scale_m * parameters.length_scale_m);
  const double variance = parameters.signal_sigma * parameters.signal_sigma;
  distances.array() = variance * (exponent * distances.array()).exp();
}

/// The same for the lower triangle of a symmetric matrix; Cholesky reads no more. Computed in the same packets as the
/// function above, so that the bits are equal.
void to_lower_kernel(const KernelParameters& parameters, Eigen::MatrixXd& distances) {
  const double exponent = -0.5 / (parameters.length_scale_m * parameters.length_scale_m);
  const double variance = parameters.signal_sigma * parameters.signal_sigma;
  const Eigen::Index size = distances.rows();
  for (Eigen::Index column = 0; column < size; ++column) {
    const Eigen::Index begin = (column * size + column) & ~Eigen::Index{1};
    const Eigen::Index end = std::min((column * size + size + 1) & ~Eigen::Index{1}, size * size);
    Eigen::Map<Eigen::ArrayXd> entries(distances.data() + begin, end - begin);
    entries = variance * (exponent * entries).exp();
  }
}

/// Adds constant and error variances to the field's kernel and factorizes. The diagonal gets a small share of the
/// signal's variance: points much closer than the length scale make the kernel numerically singular.
DenseCholesky factorize(const GaussianProcessData& data, const KernelParameters& parameters,
                        const Eigen::MatrixXd& kernel) {
  Eigen::MatrixXd covariance = kernel.array() + parameters.mean_sigma * parameters.mean_sigma;
  const double noise = parameters.noise_sigma * parameters.noise_sigma;
  double jitter =
      1e-9 * (parameters.signal_sigma * parameters.signal_sigma + parameters.mean_sigma * parameters.mean_sigma);
  covariance.diagonal().array() += data.variance.array() + noise;
  for (int attempt = 0; attempt < 6; ++attempt, jitter *= 100.0) {
    covariance.diagonal().array() += jitter;
    DenseCholesky cholesky(covariance);
    if (cholesky.is_positive_definite()) return cholesky;
  }
  throw std::invalid_argument(
      "Gaussian process: the covariance is not positive definite; check that all values are finite");
}

void check_data(const GaussianProcessData& data) {
  if (data.values.size() == 0) throw std::invalid_argument("Gaussian process: expected at least one training point");
  if (data.positions.rows() != data.values.size() || data.variance.size() != data.values.size()) {
    throw std::invalid_argument("Gaussian process: expected one position and one variance per value");
  }
}

}  // namespace

GaussianProcess::GaussianProcess(const GaussianProcessData& data, const KernelParameters& parameters)
    : positions_(data.positions), parameters_(parameters) {
  check_data(data);
  Eigen::MatrixXd kernel = squared_distances(positions_, positions_);
  to_lower_kernel(parameters_, kernel);
  cholesky_ = factorize(data, parameters_, kernel);
  const Eigen::VectorXd centred = data.values.array() - parameters_.mean;
  weights_ = cholesky_.solve(centred);
  squared_mahalanobis_ = centred.dot(weights_);
}

void GaussianProcess::predict(const Eigen::ArrayX3d& points, Eigen::VectorXd& mean, Eigen::VectorXd& variance) const {
  Eigen::MatrixXd cross = squared_distances(positions_, points);
  to_kernel(parameters_, cross);
  const double constant = parameters_.mean_sigma * parameters_.mean_sigma;
  cross.array() += constant;
  mean = (cross.transpose() * weights_).array() + parameters_.mean;
  cholesky_.solve_lower(cross);
  const double prior = parameters_.signal_sigma * parameters_.signal_sigma + constant;
  variance = (prior - cross.colwise().squaredNorm().transpose().array()).max(0.0);
}

double log_marginal_likelihood(const GaussianProcessData& data, const KernelParameters& parameters,
                               Eigen::Vector3d* gradient) {
  check_data(data);
  const Eigen::Index size = data.values.size();
  const Eigen::MatrixXd distances = squared_distances(data.positions, data.positions);
  Eigen::MatrixXd kernel = distances;
  to_kernel(parameters, kernel);
  const DenseCholesky cholesky = factorize(data, parameters, kernel);
  const Eigen::VectorXd centred = data.values.array() - parameters.mean;
  const Eigen::VectorXd weights = cholesky.solve(centred);
  const double value = -0.5 * centred.dot(weights) - 0.5 * cholesky.log_determinant() -
                       0.5 * static_cast<double>(size) * std::log(2.0 * std::numbers::pi);
  if (gradient) {
    // ½ tr((α αᵀ − K⁻¹) ∂K/∂θ); the derivatives by the logarithms are 2 K_f, K_f |d|²/l² and 2 σ_n² I.
    Eigen::MatrixXd inner = -cholesky.inverse();
    inner.noalias() += weights * weights.transpose();
    const double scale = parameters.length_scale_m * parameters.length_scale_m;
    kernel.array() *= inner.array();
    (*gradient)[0] = kernel.sum();
    (*gradient)[1] = 0.5 * (kernel.array() * distances.array()).sum() / scale;
    (*gradient)[2] = parameters.noise_sigma * parameters.noise_sigma * inner.trace();
  }
  return value;
}

}  // namespace lodestone
