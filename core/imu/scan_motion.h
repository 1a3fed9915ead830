#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/geometry/nav_state.h"
#include "core/imu/integration.h"

namespace lodestone {

/// The robot's motion within one scan, relative to its pose at the scan's end: backward propagation through the IMU
/// samples (eq:backward_propagation) from the state at t_k. Shared by points and magnetometer samples.
class ScanMotion {
 public:
  /// `end`: state at the last sample's time. `samples` cover the scan; at least one.
  ScanMotion(const NavState& end, std::span<const ImuSample> samples);

  /// The motion between two states: that of `before` at the first sample's time, that of `end` at the last sample's
  /// time. The error of backward propagation at `before` is distributed over the step as the most likely effect of
  /// white noise of gyroscope and accelerometer: a rotation linear in time, a position cubic in time (docs/design/008).
  ScanMotion(const NavState& before, const NavState& end, std::span<const ImuSample> samples);

  /// T_end_t: transforms points in the imu frame at `time` to the imu frame at the scan's end. Before the first sample
  /// and after the last one, the nearest interval is extrapolated.
  Pose relative_pose(Time time) const;

  /// T_map_imu at `time` as predicted from the end state.
  Pose pose(Time time) const;

  /// Velocity at the first sample's time, in the imu frame at the scan's end, m/s.
  Vector3 relative_begin_velocity() const;

  Time begin_time() const { return times_.front(); }
  Time end_time() const { return times_.back(); }

 private:
  Pose propagated(Time time) const;

  /// Error of backward propagation at the first sample, in the imu frame at the scan's end.
  struct Correction {
    double step_s = 0.0;
    Vector3 turn = Vector3::Zero();      ///< rotation vector
    Vector3 shift = Vector3::Zero();     ///< m
    Vector3 velocity = Vector3::Zero();  ///< m/s
  };

  Pose T_map_end_;
  Vector3 gravity_;
  std::vector<Time> times_;
  std::vector<Pose> poses_;             // T_map_imu at times_
  std::vector<Vector3> velocities_;     // map axes
  std::vector<ImuInterval> intervals_;  // interval i lies between times_[i] and times_[i + 1]
  std::optional<Correction> correction_;
};

}  // namespace lodestone
