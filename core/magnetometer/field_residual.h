#pragma once

#include "core/geometry/pose.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// Residual of a magnetometer's reading against the map, and its derivative by the pose.
struct FieldResidual {
  Vector3 residual_ut;                   ///< measured minus map, magnetometer axes, µT
  Eigen::Matrix<double, 3, 6> jacobian;  ///< ∂residual/∂(φ, p): µT/rad and µT/m, for R Exp(φ), p + δp
};

/// r = B − (R R_IMj)ᵀ M(p + R ℓ_j) (eq:mag_loc_estimate with the Jacobians of docs/design/equations.md: tangent order
/// φ, p, and the lever arm, by which an array observes yaw in a gradient). `T_map_imu`: (R, p). `T_imu_mag`: (R_IMj,
/// ℓ_j). `measured_ut`: the reading minus its bias, magnetometer axes. `map`: the field at T_map_imu *
/// T_imu_mag.position, in map axes.
FieldResidual field_residual(const Pose& T_map_imu, const Pose& T_imu_mag, const Vector3& measured_ut,
                             const FieldValue& map);

}  // namespace lodestone
