#pragma once

#include <Eigen/Core>

#include "core/mapping/dense_cholesky.h"

namespace lodestone {

/// y(x) = c + f(x) + e: a constant c ~ N(mean, mean_sigma²), a field f with the squared-exponential kernel
/// signal_sigma² exp(−|x − x'|² / 2 length_scale²), and an error e per training point of variance
/// noise_sigma² + its own known variance (GaussianProcessData::variance). Values in one unit, lengths in metres.
struct KernelParameters {
  double mean = 0.0;
  double mean_sigma = 0.0;
  double signal_sigma = 1.0;
  double length_scale_m = 0.4;
  double noise_sigma = 0.1;
};

/// Training points of one Gaussian process.
struct GaussianProcessData {
  Eigen::ArrayX3d positions;  ///< N×3, metres
  Eigen::VectorXd values;     ///< N
  Eigen::VectorXd variance;   ///< N, known error variance of each value, in addition to noise_sigma²
};

/// Exact Gaussian-process regression (Rasmussen & Williams 2006, algorithm 2.1; eq:gpr_eq and eq:gpr_cov).
class GaussianProcess {
 public:
  /// O(N³). Throws std::invalid_argument if sizes differ or there is no point.
  GaussianProcess(const GaussianProcessData& data, const KernelParameters& parameters);

  /// Posterior of c + f (without the error e) at `points`, M×3: mean and variance, M each. O(N² M).
  void predict(const Eigen::ArrayX3d& points, Eigen::VectorXd& mean, Eigen::VectorXd& variance) const;

  /// (y − mean)ᵀ K⁻¹ (y − mean): its expectation is N if the model is correct.
  double squared_mahalanobis() const { return squared_mahalanobis_; }

 private:
  Eigen::ArrayX3d positions_;
  KernelParameters parameters_;
  DenseCholesky cholesky_;
  Eigen::VectorXd weights_;  ///< K⁻¹ (y − mean)
  double squared_mahalanobis_ = 0.0;
};

/// log p(y | parameters), Rasmussen & Williams 2006, eq. (5.8). With `gradient`, also its derivative by the logarithms
/// of (signal_sigma, length_scale_m, noise_sigma), eq. (5.9).
double log_marginal_likelihood(const GaussianProcessData& data, const KernelParameters& parameters,
                               Eigen::Vector3d* gradient = nullptr);

}  // namespace lodestone
