#pragma once

#include "core/geometry/slide.h"

namespace lodestone {

/// Evaluates a factor at x₀ ⊞ P (x ⊟ x₀) instead of x: exactly, in cost and derivatives. Directions in the null space
/// of P do not affect the factor; with a slide, this holds along a bend as well. x₀ changes with every re-association
/// (docs/design/architecture.md).
class PoseMask {
 public:
  /// No direction is masked.
  PoseMask() = default;

  /// `projector`: P, tangent order φ, p. `reference`: x₀. `slide`: motion about x₀ along the direction that P removes.
  PoseMask(const Matrix6& projector, const Pose& reference, const Slide& slide = {})
      : active_(!projector.isIdentity(1e-12)), projector_(projector), reference_(reference), slide_(slide) {}

  bool active() const { return active_; }
  const Slide& slide() const { return slide_; }

  /// The pose at which the factor is evaluated; with `jacobian`, its derivative ∂(masked)/∂(x) in the right tangents of
  /// both, 6×6.
  Pose apply(const Pose& pose, Matrix6* jacobian) const {
    if (!active_) {
      if (jacobian != nullptr) jacobian->setIdentity();
      return pose;
    }
    const Seen seen = see(pose, Vector6::Zero());
    if (jacobian != nullptr) *jacobian = seen.by_pose;
    return seen.pose;
  }

  /// The masked pose of a keyframe in a map with an error.
  struct Seen {
    Pose pose;
    Matrix6 by_pose = Matrix6::Identity();  ///< in the right tangents of both
    Matrix6 by_error;                       ///< φ in map axes, p
    /// Rotation of vectors that move with the pose in map axes (a velocity). Its derivatives are in map axes.
    Quaternion turned;
    Eigen::Matrix<double, 3, 6> turned_by_pose = Eigen::Matrix<double, 3, 6>::Zero();
    Eigen::Matrix<double, 3, 6> turned_by_error = Eigen::Matrix<double, 3, 6>::Zero();
  };

  /// `error` (φ in map axes, p): of the map at the reference. It does not move when the pose slides.
  Seen see(const Pose& pose, const Vector6& error) const {
    Seen seen;
    const Quaternion error_turn = so3::exp(error.head<3>());
    seen.turned_by_error.leftCols<3>() = so3::right_jacobian(-error.head<3>());
    if (!active_) {
      seen.pose = moved_by(error, pose);
      seen.turned = error_turn;
      seen.by_error = moved_by_jacobian(error, seen.pose);
      return seen;
    }
    const SlideDifference step = difference_along(slide_, pose, reference_, error);
    const Vector6 kept = projector_ * step.value;
    Matrix6 turning = Matrix6::Identity();
    turning.topLeftCorner<3, 3>() = so3::right_jacobian(kept.head<3>());
    seen.pose = reference_.boxplus(kept);
    seen.by_pose = turning * projector_ * step.by_tangent;
    seen.by_error = turning * projector_ * step.by_error;
    seen.turned = error_turn * step.unslid.back;
    seen.turned_by_pose.rightCols<3>() = -(error_turn * slide_.turn) * step.unslid.by_position.transpose();
    return seen;
  }

  /// Masked departure (Deskewing): its rotation and shift are one motion of the previous keyframe, its slopes are pure
  /// shifts.
  Eigen::Matrix<double, 12, 1> hide_departure(const Eigen::Matrix<double, 12, 1>& departure) const {
    if (!active_) return departure;
    return departure_projector() * departure;
  }

  /// The same for a derivative by a departure.
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
