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

/// A keyframe's readings of the field, weighed: what its factor is made of.
struct KeyframeField {
  std::vector<FieldReading> readings;  ///< of magnetic.measurement = field
  std::optional<MeasuredPose> pose;    ///< of magnetic.measurement = pose
  PoseMask mask;
};

/// From a keyframe's scan and readings to its factors, the same for the sliding window and for the batch. Does not
/// change while it works: different keyframes may be worked on at the same time.
class KeyframeMeasurements {
 public:
  explicit KeyframeMeasurements(EstimatorInput input);

  /// Deskews, associates and condenses the keyframe's scan at `state`. `before`: the state of the keyframe before; null
  /// where none is known. Without LiDAR the magnetometers' height takes its place, where the field map has one layer.
  void register_scan(Keyframe& keyframe, const NavState& state, const NavState* before) const;

  /// The degeneracy of a keyframe, by the rule in force. `known`: gives what LiDAR and IMU together know of its pose
  /// (φ, p), less so many times what noisy normals pretend to give; called only where the rule asks for it.
  Degeneracy analyse(const Keyframe& keyframe, const NavState& state,
                     const std::function<Matrix6(double noise_taken)>& known) const;

  /// Puts the analysis of a keyframe in force; hidden directions follow `before` (null: nothing to follow), which was
  /// analysed at `pose_before`.
  void decide(Keyframe& keyframe, const Degeneracy& analysed, const Degeneracy* before, const Pose& pose_before) const;

  /// What the keyframe's LiDAR factor is let see.
  PoseMask lidar_mask(const Keyframe& keyframe) const;

  /// The keyframe's LiDAR factor with its mask.
  void set_lidar(const Keyframe& keyframe, std::size_t k, SlidingWindow& window) const;

  /// Weighs the keyframe's readings of the field. `bias_ut` and `matrix` (E): of each magnetometer; `clock`: of all.
  /// Fills the diagnostics.
  KeyframeField weigh(Keyframe& keyframe, const NavState& state, const std::function<Vector3(int)>& bias_ut,
                      const std::function<Matrix3(int)>& matrix, const SlidingWindow::ClockOffset& clock) const;

  /// Adds the residuals of the keyframe's readings at the pose to what is known of the field's error.
  void judge_field_error(const Keyframe& keyframe, const Pose& T_map_imu, const std::function<Vector3(int)>& bias_ut,
                         const std::function<Matrix3(int)>& matrix, const SlidingWindow::ClockOffset& clock,
                         FieldError& error) const;

  /// The keyframe's field factor.
  void set_field(const KeyframeField& field, std::size_t k, SlidingWindow& window) const;

 private:
  void hold_height(Keyframe& keyframe) const;  // in place of the scan's correspondences
  bool at_level(const Pose& T_map_imu) const;

  EstimatorInput input_;
  std::unique_ptr<Plane> level_;  // the field map's height, where LiDAR does not tell it
  std::vector<double> crowding_;  // of the magnetometers
  double sensor_gate_;            // of a magnetometer against its fellows
};

}  // namespace lodestone
