#pragma once

#include <cmath>

#include "factors/pose_mask.h"

namespace lodestone {

/// A bend of 400 m: a metre along it turns by 2.5 mrad. Tangent order φ, p (map axes) at `pose`, whose heading it has.
inline Vector6 along_bend(const Pose& pose) {
  Vector6 result;
  result << Vector3(0.0, 0.0, 1.0 / 400.0), pose.rotation * Vector3::UnitX();
  return result;
}

/// The pose along the bend from `pose`.
inline Pose slid_along_bend(const Pose& pose, double distance_m) {
  const double angle = distance_m / 400.0;
  return pose * Pose{so3::exp(angle * Vector3::UnitZ()), 400.0 * Vector3(std::sin(angle), 1.0 - std::cos(angle), 0.0)};
}

inline PoseMask bend_mask(const Pose& reference) {
  const Vector6 hidden = along_bend(reference).normalized();
  return {Matrix6::Identity() - hidden * hidden.transpose(), reference, Slide::along(hidden, reference)};
}

}  // namespace lodestone
