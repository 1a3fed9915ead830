#pragma once

#include <array>
#include <vector>

#include "core/geometry/so3.h"

namespace lodestone {

/// Eigenfunctions of the Laplace operator on a box, zero on its faces (Solin & Särkkä 2020, eq. 56; Solin et al. 2018,
/// eq. 20): φ_j(x) = Π_d L_d^(−½) sin(ω_jd (x_d − c_d + L_d)), ω_jd = π n_jd / 2 L_d, n_jd = 1, 2, …
/// Includes the functions with Σ (ℓ_d ω_jd)² ≤ cutoff², where ℓ are the kernel's length scales. Orthonormal on the box.
class LaplaceBasis {
 public:
  /// `centre` (metres) and `half_sides` (L) of the box.
  LaplaceBasis(const Vector3& centre, const Vector3& half_sides, const Vector3& length_scales_m, double cutoff);

  /// Number of functions of such a box.
  static std::size_t count(const Vector3& half_sides, const Vector3& length_scales_m, double cutoff);

  Eigen::Index size() const { return static_cast<Eigen::Index>(modes_.size()); }

  /// Spectral density of the unit-variance squared-exponential kernel at each function's wave numbers, metres³:
  /// (2π)^(3/2) ℓ_x ℓ_y ℓ_z exp(−½ Σ (ℓ_d ω_jd)²). It is the prior variance of the function's weight.
  Eigen::VectorXd spectral_density() const;

  /// φ_j at a point.
  Eigen::VectorXd values(const Vector3& point) const;

  /// ∂φ_j/∂x_d at points: three columns (x, y, z) per point, one row per function.
  Eigen::MatrixXd gradients(const std::vector<Vector3>& points) const;

  /// Σ_i w_i ∇φ_j(x_i)ᵀ ∇φ_k(x_i), lower triangle; the rest is zero. A product of sines or cosines is a sum of two
  /// cosines, so the sum depends on n_j ± n_k only (Viset et al. 2023). The cost is N times the number of functions,
  /// not N times the number of pairs.
  Eigen::MatrixXd gradient_products(const std::vector<Vector3>& points, const Eigen::VectorXd& weights) const;

  /// Σ_i w_id ∂φ_j/∂x_d (x_i): one row per function, one column per component. `weights`: N×3.
  Eigen::MatrixX3d gradient_sums(const std::vector<Vector3>& points, const Eigen::MatrixX3d& weights) const;

 private:
  using Mode = std::array<int, 3>;  ///< n_j

  /// sin(n θ) or cos(n θ) of an axis, θ = π (x − c + L) / 2L: one row per point, one column per n = 0 … highest.
  Eigen::MatrixXd sines(const std::vector<Vector3>& points, int axis, int highest) const;
  Eigen::MatrixXd cosines(const std::vector<Vector3>& points, int axis, int highest) const;
  double scale() const { return 1.0 / std::sqrt(half_sides_.prod()); }
  double wave_number(const Mode& mode, int axis) const {
    return wave_step_[axis] * mode[static_cast<std::size_t>(axis)];
  }

  Vector3 centre_;
  Vector3 half_sides_;
  Vector3 length_scales_;
  Vector3 wave_step_;             ///< π / 2 L_d
  std::array<int, 3> highest_{};  ///< n
  std::vector<Mode> modes_;
};

}  // namespace lodestone
