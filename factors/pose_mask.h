#pragma once

#include "core/geometry/slide.h"

namespace lodestone {

/// Lets a factor look at x₀ ⊞ P (x ⊟ x₀) instead of x: exactly, in cost as in derivatives. What lies in the null space of
/// P is hidden from the factor, along a bend as well where it is told of it; x₀ moves with every re-association
/// (docs/architecture.md).
class PoseMask {
 public:
  /// Nothing hidden.
  PoseMask() = default;

  /// `projector`: P, tangent order φ, p. `reference`: x₀. `slide`: about x₀, of the direction that P hides.
  PoseMask(const Matrix6& projector, const Pose& reference, const Slide& slide = {})
      : active_(!projector.isIdentity(1e-12)), projector_(projector), reference_(reference), slide_(slide) {}

  bool active() const { return active_; }
  const Slide& slide() const { return slide_; }

  /// The pose the factor sees; with `jacobian`, ∂(seen)/∂(x) in the right tangents of both, 6×6.
  Pose apply(const Pose& pose, Matrix6* jacobian) const {
    if (!active_) {
      if (jacobian != nullptr) jacobian->setIdentity();
      return pose;
    }
    const SlideDifference step = difference_along(slide_, pose, reference_);
    const Vector6 seen = projector_ * step.value;
    if (jacobian != nullptr) {
      *jacobian = projector_ * step.by_tangent;
      jacobian->topRows<3>() = (so3::right_jacobian(seen.head<3>()) * jacobian->topRows<3>()).eval();
    }
    return reference_.boxplus(seen);
  }

  /// What of a small motion (φ, p) of the robot the factor sees, and of a derivative by one.
  Vector6 hide(const Vector6& motion) const { return active_ ? (projector_ * motion).eval() : motion; }
  template <class Derived>
  Eigen::Matrix<double, Derived::RowsAtCompileTime, 6> hide_from(const Eigen::MatrixBase<Derived>& jacobian) const {
    if (!active_) return jacobian;
    return jacobian * projector_;
  }

 private:
  bool active_ = false;
  Matrix6 projector_ = Matrix6::Identity();
  Pose reference_;
  Slide slide_;
};

}  // namespace lodestone
