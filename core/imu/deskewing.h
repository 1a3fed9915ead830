#pragma once

#include "core/geometry/nav_state.h"
#include "core/imu/scan_motion.h"
#include "core/sensor_suite.h"

namespace lodestone {

using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

/// The motion that a scan was deskewed with, from the keyframe before to the scan's end. The states at both ends may
/// differ from this motion; the difference displaces the points (docs/design/008).
struct Deskewing {
  /// For points that are not deskewed.
  Deskewing() = default;

  /// `motion`: from the keyframe before to the scan's end. `end`: the state at the scan's end from which `motion` was
  /// computed.
  Deskewing(const NavState& end, const ScanMotion& motion, const ImuNoise& noise);

  Quaternion turn = Quaternion::Identity();   ///< R_beforeᵀ R_end
  Vector3 velocity = Vector3::Zero();         ///< at the scan's end, imu axes at the end, m/s
  Vector3 before_position = Vector3::Zero();  ///< of the keyframe before, imu frame at the end, m
  Vector3 before_velocity = Vector3::Zero();  ///< of the keyframe before, imu axes at the end, m/s
  double step_s = 0.0;                        ///< from the keyframe before to the scan's end; 0: nothing was deskewed
  double gyroscope_density = 0.0;             ///< power of the noise, rad²/s
  double accelerometer_density = 0.0;         ///< m²/s³
  /// Errors of the biases and of gravity in the motion, if there is no keyframe before: nothing else bounds them then.
  double gyroscope_bias_variance = 0.0;  ///< rad²/s²
  double acceleration_variance = 0.0;    ///< of the accelerometer's bias and gravity, m²/s⁴

  /// Derivatives of the departure by the right tangents (φ, p) of both poses, and by both velocities.
  struct Jacobians {
    Eigen::Matrix<double, 12, 6> by_end = Eigen::Matrix<double, 12, 6>::Zero();
    Eigen::Matrix<double, 12, 3> by_end_velocity = Eigen::Matrix<double, 12, 3>::Zero();
    Eigen::Matrix<double, 12, 6> by_before = Eigen::Matrix<double, 12, 6>::Zero();
    Eigen::Matrix<double, 12, 3> by_before_velocity = Eigen::Matrix<double, 12, 3>::Zero();
  };

  /// Departure of the states from the motion: the turn of the robot at the keyframe before (rad, imu axes at the end),
  /// and in map axes the slope by age at the end (m/s), the shift (m) and the slope by age at the keyframe before
  /// (m/s). A point of age t must be rotated by t / step of the turn, and shifted by the Hermite cubic of the others
  /// (core/imu/hermite.h). `before`: null if unknown. Then only the slope at the end is not zero.
  Vector12 departure(const NavState* before, const NavState& end, Jacobians* jacobians) const;
};

}  // namespace lodestone
