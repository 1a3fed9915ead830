#pragma once

#include "core/geometry/pose.h"

namespace lodestone {

/// Whether two poses are nearer than `shift_m` and `turn_rad`.
inline bool are_near(const Pose& a, const Pose& b, double shift_m, double turn_rad) {
  const Vector6 apart = a.boxminus(b);
  return apart.tail<3>().norm() < shift_m && apart.head<3>().norm() < turn_rad;
}

}  // namespace lodestone
