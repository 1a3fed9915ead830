#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/lidar/plane_map.h"
#include "estimators/factory.h"
#include "estimators/smoother/field_error.h"
#include "estimators/smoother/keyframe.h"
#include "factors/sliding_window.h"

namespace lodestone {

/// The weighted field readings of a keyframe, as input of its factor.
struct KeyframeField {
  std::vector<FieldReading> readings;  ///< if magnetic.measurement = field
  std::optional<MeasuredPose> pose;    ///< if magnetic.measurement = pose
  PoseMask mask;
};

/// Converts a keyframe's scan and readings to factors; the same for the sliding window and the batch. Immutable:
/// different keyframes may be processed concurrently.
class KeyframeMeasurements {
 public:
  explicit KeyframeMeasurements(EstimatorInput input);

  /// Deskews, associates and condenses the keyframe's scan at `state`. `before`: state of the previous keyframe; null
  /// if unknown. Without LiDAR, and with a field map of one layer, the magnetometers' height replaces the
  /// correspondences.
  void register_scan(Keyframe& keyframe, const NavState& state, const NavState* before) const;

  /// The degeneracy of a keyframe, by the configured rule. `known`: returns the information of LiDAR and IMU together
  /// about its pose (φ, p), less `noise_subtracted` times the spurious information of noisy normals; called only if the
  /// rule requires it.
  Degeneracy analyse(const Keyframe& keyframe, const NavState& state,
                     const std::function<Matrix6(double noise_subtracted)>& known) const;

  /// Stores the analysis in the keyframe. Degenerate directions follow those of `before` (null: no previous analysis),
  /// which was analysed at `pose_before`.
  void decide(Keyframe& keyframe, const Degeneracy& analysed, const Degeneracy* before, const Pose& pose_before) const;

  /// The mask of the keyframe's LiDAR factor.
  PoseMask lidar_mask(const Keyframe& keyframe) const;

  /// Sets the keyframe's LiDAR factor with its mask.
  void set_lidar(const Keyframe& keyframe, std::size_t k, SlidingWindow& window) const;

  /// Weights the keyframe's field readings and fills the diagnostics. `bias_ut` and `matrix` (E): of each magnetometer;
  /// `clock`: of all.
  KeyframeField weigh(Keyframe& keyframe, const NavState& state, const std::function<Vector3(int)>& bias_ut,
                      const std::function<Matrix3(int)>& matrix, const SlidingWindow::ClockOffset& clock) const;

  /// Updates the estimated field error with the residuals of the keyframe's readings at the pose.
  void judge_field_error(const Keyframe& keyframe, const Pose& T_map_imu, const std::function<Vector3(int)>& bias_ut,
                         const std::function<Matrix3(int)>& matrix, const SlidingWindow::ClockOffset& clock,
                         FieldError& error) const;

  /// Sets the keyframe's field factor.
  void set_field(const KeyframeField& field, std::size_t k, SlidingWindow& window) const;

  /// Averages and weights the keyframe's wheel samples at the predicted state, and fills the diagnostics. `covariance`:
  /// of that state; `correction` and `sigmas`: of the wheels' calibration. No effect without wheels.
  void weigh_wheels(Keyframe& keyframe, const NavState& predicted, const Matrix17& covariance,
                    const WheelCorrection& correction, WheelCalibrationSigmas sigmas) const;

  /// Sets the keyframe's wheel factor at the present state, with the weights of the prediction.
  void set_wheels(const Keyframe& keyframe, const NavState& state, std::size_t k, SlidingWindow& window) const;

 private:
  /// Whether readings of the keyframe lie on the field map.
  bool has_field(const Keyframe& keyframe, const Vector3& position) const;

  void hold_height(Keyframe& keyframe) const;  // replaces the scan's correspondences
  bool at_level(const Pose& T_map_imu) const;

  EstimatorInput input_;
  std::unique_ptr<Plane> level_;  // height of the field map, if LiDAR does not observe it
  std::vector<double> crowding_;  // of the magnetometers
  double sensor_gate_;            // of one magnetometer against the others of its array
};

}  // namespace lodestone
