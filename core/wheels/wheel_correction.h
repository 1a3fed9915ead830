#pragma once

#include "core/geometry/pose.h"

namespace lodestone {

/// Correlation time of the slowly varying part of the wheels' scale (docs/design/049-wheels.md).
inline constexpr double kSlipCorrelation_s = 20.0;

/// Correction of the wheels' calibration in the platform file: the wheels report (1 + scale) times the velocity, and
/// the rotation of T_imu_wheels is R₀ Exp(turn).
struct WheelCorrection {
  double scale = 0.0;
  Vector3 turn_rad = Vector3::Zero();  ///< wheel axes

  Pose corrected(const Pose& T_imu_wheels) const {
    return {(T_imu_wheels.rotation * so3::exp(turn_rad)).normalized(), T_imu_wheels.position};
  }
};

}  // namespace lodestone
