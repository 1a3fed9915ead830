#pragma once

#include "core/geometry/so3.h"

namespace lodestone {

/// A rigid transform. T_a_b transforms points in frame b to frame a: p_a = T_a_b * p_b.
struct Pose {
  Quaternion rotation = Quaternion::Identity();
  Vector3 position = Vector3::Zero();  ///< metres

  Vector3 operator*(const Vector3& point) const { return rotation * point + position; }

  Pose operator*(const Pose& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.position + position};
  }

  Pose inverse() const {
    const Quaternion conjugate = rotation.conjugate();
    return {conjugate, -(conjugate * position)};
  }

  /// Box-plus, tangent order φ, p: R Exp(φ), p + δp (the position adds in the outer frame).
  Pose boxplus(const Vector6& delta) const {
    return {(rotation * so3::exp(delta.head<3>())).normalized(), position + delta.tail<3>()};
  }

  /// Box-minus, tangent order φ, p: the δ with other.boxplus(δ) equal to this.
  Vector6 boxminus(const Pose& other) const {
    Vector6 delta;
    delta.head<3>() = so3::log(other.rotation.conjugate() * rotation);
    delta.tail<3>() = position - other.position;
    return delta;
  }
};

}  // namespace lodestone
