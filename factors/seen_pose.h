#pragma once

#include "core/geometry/nav_state.h"
#include "core/lidar/swept_cost.h"

namespace lodestone {

/// A pose as the scan sees it in the map: moved by what the LiDAR's mounting departs from that with which the scan was
/// brought to the imu frame, and by the error of the map there. Derivatives of the seen pose's right tangent (φ; p in
/// map axes).
struct SeenPose {
  Pose pose;
  Matrix6 by_pose = Matrix6::Identity();
  Matrix6 by_mounting = Matrix6::Zero();   ///< by turn and shift (LidarCorrection)
  Matrix6 by_map_error = Matrix6::Zero();  ///< by the map's error (φ in map axes, p)
};

/// By the mounting alone: turn and shift; null where it is not estimated. A scan that is not the LiDAR's is seen where
/// the robot is.
SeenPose see(const CondensedScan& scan, const Pose& T_map_imu, const double* mounting);

/// By an error of the map as well (φ in map axes, p).
void move_by(const Vector6& map_error, SeenPose& seen);

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
