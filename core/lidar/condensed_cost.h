#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

/// The marginal rule subtracts this multiple of the expected spurious information of noisy normals
/// (docs/design/005-errors-of-normals.md).
inline constexpr double kNormalNoiseMargin = 2.0;

using Vector13 = Eigen::Matrix<double, 13, 1>;
using Matrix13 = Eigen::Matrix<double, 13, 13>;
using Matrix13x6 = Eigen::Matrix<double, 13, 6>;

/// All point-to-plane residuals of a scan as one quadratic form in ξ = [vec(R); R c + t − t₀; 1] ∈ R¹³ (vec by
/// columns), with the scan's centroid c, and t₀ the centroid's position at the pose of accumulation: Σ w r² = ξᵀ M ξ,
/// exact at every pose. Centring preserves digits that squaring would lose. docs/design/007
struct CondensedCost {
  Matrix13 moment = Matrix13::Zero();  ///< M, whitened: Σ w a aᵀ, symmetric and positive semidefinite
  Vector3 centroid = Vector3::Zero();  ///< c, imu frame
  Vector3 anchor = Vector3::Zero();    ///< t₀, map frame
  /// S = Σ w A C_n Aᵀ, tangent order φ, p: the spurious information of errors of the planes' normals, at the pose of
  /// accumulation. The correct pose information is the Hessian minus S (docs/design/005).
  Matrix6 spurious_information = Matrix6::Zero();
  double weight_sum = 0.0;   ///< Σ w, 1/m²
  double range_rms_m = 0.0;  ///< rms distance of the points from the imu: the lever arm of rotations
  int count = 0;             ///< correspondences

  /// ξ at a pose.
  Vector13 coordinates(const Pose& T_map_imu) const;

  /// ∂ξ/∂(φ, p) under the right perturbation.
  Matrix13x6 coordinates_jacobian(const Pose& T_map_imu) const;

  /// Σ w r², dimensionless.
  double cost(const Pose& T_map_imu) const;

  /// Gauss-Newton Hessian Jᵀ W J (6×6, tangent order φ, p) and gradient Jᵀ W r.
  Matrix6 hessian(const Pose& T_map_imu) const;
  Vector6 gradient(const Pose& T_map_imu) const;

  /// P = I − H⁻¹ S with S the spurious information, limited to between 0 and I. A wrong normal makes the Jacobian wrong
  /// and its square too large; the estimate is drawn to the linearization point. A motion multiplied by P gives the
  /// information (H − S) H⁻¹ (H − S) and the step −(H − S)⁻¹ g: corrected least squares of errors in variables (Fuller
  /// 1987; docs/design/005).
  Matrix6 seen_share(const Pose& T_map_imu) const;
};

/// Accumulates M in a fixed number of chunks, reduced in order: the same bits on any number of threads. `T_map_imu`:
/// the pose of accumulation.
CondensedCost condense(std::span<const Correspondence> correspondences, const Pose& T_map_imu);

}  // namespace lodestone
