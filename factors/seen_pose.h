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

/// How a robot moves at a moment; axes of the imu at that moment.
struct MotionRates {
  Vector3 turn_rate = Vector3::Zero();     ///< rad/s
  Vector3 acceleration = Vector3::Zero();  ///< of the imu, m/s²
};

/// A state at one end of a scan's step, as the scan sees it: moved back along its own motion by
/// δ = clock − (clock that the scan was deskewed with), then by the mounting. The LiDAR swings about the imu, so that
/// its velocity differs from the imu's where the mounting is shifted. The rates are taken as known (docs/design/041).
struct SeenState {
  /// `calibration`: turn, shift and clock; null where it is not estimated.
  SeenState(const CondensedScan& scan, const NavState& state, const MotionRates& rates, const double* calibration);

  NavState state;
  Eigen::Matrix<double, 9, 9> by_state = Eigen::Matrix<double, 9, 9>::Identity();    ///< φ (right), p, v of both
  Eigen::Matrix<double, 9, 7> by_calibration = Eigen::Matrix<double, 9, 7>::Zero();  ///< by turn, shift, clock
};

}  // namespace lodestone
