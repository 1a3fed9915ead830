#pragma once

#include "core/geometry/nav_state.h"
#include "core/imu/scan_motion.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// What a scan was deskewed with. The noise of the gyroscope that turns the points also turns the preintegrated step to the
/// scan's end, and an error of the velocity shifts the points as it shifts the step: what deskewing took wrongly is told by
/// the states at both ends. `rates` is that error as one turn and one shift a second, back from the end.
struct Deskewing {
  /// Of points that need none.
  Deskewing() = default;

  /// `end`: the state at the scan's end that `motion`, from the keyframe before to the scan's end, was made with.
  Deskewing(const NavState& end, const ScanMotion& motion, const ImuNoise& noise);

  Quaternion turn = Quaternion::Identity();  ///< R_beforeᵀ R_end, as the scan was deskewed with
  Vector3 velocity = Vector3::Zero();        ///< at the scan's end, its body axes, m/s, as the scan was deskewed with
  double step_s = 0.0;                       ///< from the keyframe before to the scan's end; 0: nothing was deskewed
  double gyroscope_density = 0.0;            ///< of the noise's power, rad²/s
  double accelerometer_density = 0.0;        ///< m²/s³

  /// Derivatives of the rates by right perturbations of the states.
  struct Jacobians {
    Matrix3 turn_by_before = Matrix3::Zero();
    Matrix3 turn_by_end = Matrix3::Zero();
    Matrix3 shift_by_end = Matrix3::Zero();  // by velocity it is −I
  };

  /// Where a point taken t before the end belongs, had the robot been at these states: turned by t times the first three
  /// (rad/s, body axes at the end) and shifted by t times the others (m/s, map axes). A scan leans on the velocity in the
  /// robot's own axes: a map turned with all that moves in it tells nothing. `before`: null where it is not known; then the
  /// turn is zero.
  Vector6 rates(const Quaternion* before, const Quaternion& end, const Vector3& end_velocity, Jacobians* jacobians) const;

  /// For checkpoints.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(turn, velocity, step_s, gyroscope_density, accelerometer_density);
  }
};

}  // namespace lodestone
