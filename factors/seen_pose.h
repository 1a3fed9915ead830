#pragma once

#include "core/geometry/nav_state.h"
#include "core/lidar/swept_cost.h"

namespace lodestone {

/// Pose and velocity at one end of a scan's step as the scan sees them in the map: moved by what the LiDAR's mounting
/// departs from that with which the scan was brought to the imu frame, and by the error of the map there.
struct SeenState {
  Pose pose;
  Vector3 velocity = Vector3::Zero();

  /// Of the seen pose's right tangent (φ; p in map axes).
  Matrix6 by_pose = Matrix6::Identity();
  Matrix6 by_mounting = Matrix6::Zero();   ///< by turn and shift (LidarCorrection)
  Matrix6 by_map_error = Matrix6::Zero();  ///< by the map's error (φ in map axes, p)
  /// Of the seen velocity.
  Matrix3 velocity_by_velocity = Matrix3::Identity();
  Eigen::Matrix<double, 3, 6> velocity_by_map_error = Eigen::Matrix<double, 3, 6>::Zero();
};

/// `mounting` (turn, shift) and `map_error`: null where they are not estimated. A scan that is not the LiDAR's is seen
/// where the robot is.
SeenState see(const CondensedScan& scan, const Pose& T_map_imu, const Vector3& velocity, const double* mounting,
              const double* map_error);

/// What a late clock makes of the states at both ends of a scan's step: each is moved back along its own motion by
/// δ = clock − (clock that the scan was deskewed with). The turn rate and the acceleration are those that the IMU
/// measured. Rates of the states would let the clock explain noise: a scan seen at R_k less a share of R_k − R_k₋₁ fits
/// any noise of LiDAR better than R_k does (docs/design/041).
struct ClockShift {
  ClockShift(const CondensedScan& scan, const NavState& end, double clock_s);

  /// A state at either end, moved.
  NavState moved(const NavState& state) const;

  double late_s = 0.0;                            ///< δ
  Vector3 turn_rate = Vector3::Zero();            ///< rad/s, imu axes at the end
  Vector3 acceleration = Vector3::Zero();         ///< m/s², map axes
  Matrix3 acceleration_by_end = Matrix3::Zero();  ///< by the rotation at the end
  Matrix3 turned = Matrix3::Identity();           ///< ∂φ(moved)/∂φ
  Vector3 turn_by_clock = Vector3::Zero();        ///< ∂φ(moved)/∂clock
};

}  // namespace lodestone
