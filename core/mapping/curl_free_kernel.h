#pragma once

#include <vector>

#include "core/mapping/field_survey.h"
#include "core/mapping/kernel_fit.h"

namespace lodestone {

/// B(x) = m + b − ∇φ(x) + e. Without currents, the field is the gradient of a potential φ (Wahlström et al. 2013;
/// Solin et al. 2018, eq. 8 to 12). φ has a squared-exponential kernel, b (the linear potential −bᵀx) is normal with
/// mean zero, and e is white noise per cell and component, in addition to the cell's own noise. Fields in µT, map axes.
/// φ has a separate vertical length scale, because steel lies mostly below the robot. In a survey at one height, the
/// vertical length scale follows from the variance of B_z relative to B_x and B_y.
struct CurlFreeKernel {
  Vector3 mean_ut = Vector3::Zero();     ///< m
  double linear_sigma_ut = 10.0;         ///< of b, per component
  double signal_sigma_ut = 5.0;          ///< of −∂φ/∂x and −∂φ/∂y
  double length_scale_m = 0.5;           ///< of φ in x and y
  double vertical_length_scale_m = 0.5;  ///< of φ in z
  double noise_sigma_ut = 0.1;           ///< of e

  Vector3 length_scales_m() const { return {length_scale_m, length_scale_m, vertical_length_scale_m}; }

  /// Sigma of −∇φ per component: the sigma of φ over the length scale.
  Vector3 signal_sigmas_ut() const { return signal_sigma_ut * length_scale_m * length_scales_m().cwiseInverse(); }
};

/// Cov(∇φ(x), ∇φ(x')), µT², for offset = x − x' (metres):
/// σ_φ² (δ_ij / ℓ_i² − d_i d_j / (ℓ_i² ℓ_j²)) exp(−½ Σ d_i² / ℓ_i²).
Matrix3 curl_free_covariance(const CurlFreeKernel& kernel, const Vector3& offset);

/// log p(all components of the cells | kernel). With `gradient`, also its derivative by the logarithms of
/// (signal_sigma_ut, length_scale_m, vertical_length_scale_m, noise_sigma_ut, linear_sigma_ut). O((3N)³). Throws
/// std::invalid_argument without cells.
double log_marginal_likelihood(const std::vector<FieldCell>& cells, const CurlFreeKernel& kernel,
                               Eigen::Matrix<double, 5, 1>* gradient = nullptr);

struct CurlFreeFit {
  CurlFreeKernel kernel;
  double log_likelihood = 0.0;  ///< summed over the sets
  int evaluations = 0;
  bool converged = false;
};

/// The kernel with the maximum likelihood over all `sets`. The sets are independent draws, each with its own b. `start`
/// gives the mean, which is fixed, and the initial values of the other parameters. Deterministic on any number of
/// threads. Throws std::invalid_argument without sets.
CurlFreeFit fit_curl_free_kernel(const std::vector<std::vector<FieldCell>>& sets, const CurlFreeKernel& start,
                                 const KernelBounds& bounds);

}  // namespace lodestone
