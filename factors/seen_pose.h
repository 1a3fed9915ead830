#pragma once

#include "core/geometry/nav_state.h"
#include "core/lidar/swept_cost.h"

namespace lodestone {

/// Pose of a scan in the map: the keyframe's pose, moved by the difference of the LiDAR's mounting from the one used
/// for the transformation to the imu frame, and by the map's error there. Derivatives are of its right tangent (φ; p in
/// map axes).
struct SeenPose {
  Pose pose;
  Matrix6 by_pose = Matrix6::Identity();
  Matrix6 by_mounting = Matrix6::Zero();   ///< by rotation and shift of the mounting (LidarCorrection)
  Matrix6 by_map_error = Matrix6::Zero();  ///< by the map's error (φ in map axes, p)
};

/// Applies the mounting alone: rotation and shift; null if not estimated. Correspondences that are not from LiDAR use
/// the keyframe's pose.
SeenPose see(const CondensedScan& scan, const Pose& T_map_imu, const double* mounting);

/// Also applies an error of the map (φ in map axes, p).
void move_by(const Vector6& map_error, SeenPose& seen);

/// Rates of motion at one time; axes of the imu at that time.
struct MotionRates {
  Vector3 turn_rate = Vector3::Zero();     ///< rad/s
  Vector3 acceleration = Vector3::Zero();  ///< of the imu, m/s²
};

/// Rates at a keyframe: the central difference of its neighbours over the `span_s` between them, also if its two steps
/// differ in length. The noise of `here` cancels (docs/design/041). Null: no neighbour on that side.
MotionRates rates_between(const NavState* before, const NavState& here, const NavState* after, double span_s);

/// The state at one end of a scan's step, for the evaluation of the scan: moved back along its own motion by δ = clock
/// − (clock used for deskewing), then by the mounting. The LiDAR rotates about the imu, so a shift of the mounting
/// changes its velocity. The rates are assumed to be known (docs/design/041).
struct SeenState {
  /// `calibration`: rotation, shift and clock; null if not estimated.
  SeenState(const CondensedScan& scan, const NavState& state, const MotionRates& rates, const double* calibration);

  NavState state;
  Eigen::Matrix<double, 9, 9> by_state = Eigen::Matrix<double, 9, 9>::Identity();    ///< φ (right), p, v of both
  Eigen::Matrix<double, 9, 7> by_calibration = Eigen::Matrix<double, 9, 7>::Zero();  ///< by turn, shift, clock
};

}  // namespace lodestone
