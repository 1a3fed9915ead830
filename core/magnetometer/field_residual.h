#pragma once

#include "core/geometry/pose.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// A magnetometer's reading against the map, and how that changes with the pose.
struct FieldResidual {
  Vector3 residual_ut;                   ///< measured minus map, magnetometer axes, µT
  Eigen::Matrix<double, 3, 6> jacobian;  ///< ∂residual/∂(φ, p): µT/rad and µT/m, for R Exp(φ), p + δp
};

/// r = B − (R R_IMj)ᵀ M(p + R ℓ_j) (eq:mag_loc_estimate with the Jacobians of docs/design/architecture.md: tangent
/// order φ, p, and the lever arm, through which an array sees yaw in a gradient). `T_map_imu`: (R, p). `T_imu_mag`:
/// (R_IMj, ℓ_j). `measured_ut`: the reading less its bias, magnetometer axes. `map`: the field at T_map_imu *
/// T_imu_mag.position, in map axes.
FieldResidual field_residual(const Pose& T_map_imu, const Pose& T_imu_mag, const Vector3& measured_ut,
                             const FieldValue& map);

}  // namespace lodestone
