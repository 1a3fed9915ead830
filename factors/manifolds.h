#pragma once

#include <ceres/manifold.h>

#include <array>

#include "core/geometry/nav_state.h"

namespace lodestone {

/// Parameter block of a pose: qx qy qz qw px py pz.
using PoseBlock = std::array<double, 7>;

/// Parameter block of a keyframe's other variables: v, b_g, b_a.
using MotionBlock = std::array<double, 9>;

Pose to_pose(const double* block);
void from_pose(const Pose& pose, double* block);

/// Converts a Jacobian by the tangent φ, p to the ambient one that Ceres expects: J_ambient · PlusJacobian = J_tangent.
/// `jacobian`: rows×6. `ambient`: rows×7, row-major.
void to_ambient(const double* pose_block, const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 6>>& jacobian,
                double* ambient);

/// SE(3) as a product: R Exp(φ), p + δp. Perturbation on the right by the full angle (Ceres' own quaternion manifold
/// perturbs on the left by half of it).
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// Gravity: a vector of fixed length, two degrees of freedom (s2::boxplus).
class GravityManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 3; }
  int TangentSize() const override { return 2; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace lodestone
