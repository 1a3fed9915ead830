#pragma once

#include "core/geometry/slide.h"

namespace lodestone {

/// Lets a factor look at x₀ ⊞ P (x ⊟ x₀) instead of x: exactly, in cost as in derivatives. What lies in the null space
/// of P is hidden from the factor, along a bend as well where it is told of it; x₀ moves with every re-association
/// (docs/design/architecture.md).
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

  /// What of a departure (Deskewing) the factor sees: its turn and its shift are one motion of the keyframe before, its
  /// slopes are shifts alone.
  Eigen::Matrix<double, 12, 1> hide_departure(const Eigen::Matrix<double, 12, 1>& departure) const {
    if (!active_) return departure;
    return departure_projector() * departure;
  }

  /// The same of a derivative by a departure.
  template <class Derived>
  Eigen::Matrix<double, Derived::RowsAtCompileTime, 12> hide_departure_from(
      const Eigen::MatrixBase<Derived>& jacobian) const {
    if (!active_) return jacobian;
    return jacobian * departure_projector();
  }

 private:
  Eigen::Matrix<double, 12, 12> departure_projector() const {
    constexpr int kTurn = 0;
    constexpr int kShift = 6;
    Eigen::Matrix<double, 12, 12> result = Eigen::Matrix<double, 12, 12>::Zero();
    result.block<3, 3>(kTurn, kTurn) = projector_.topLeftCorner<3, 3>();
    result.block<3, 3>(kTurn, kShift) = projector_.topRightCorner<3, 3>();
    result.block<3, 3>(kShift, kTurn) = projector_.bottomLeftCorner<3, 3>();
    for (const int shift : {3, kShift, 9}) result.block<3, 3>(shift, shift) = projector_.bottomRightCorner<3, 3>();
    return result;
  }

  bool active_ = false;
  Matrix6 projector_ = Matrix6::Identity();
  Pose reference_;
  Slide slide_;
};

}  // namespace lodestone
