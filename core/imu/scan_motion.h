#pragma once

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

  /// T_end_t: takes points in the imu frame at `time` to the imu frame at the scan's end. Before the first sample and
  /// after the last one the nearest interval is continued.
  Pose relative_pose(Time time) const;

  /// T_map_imu at `time` as predicted from the end state.
  Pose pose(Time time) const;

  Time begin_time() const { return times_.front(); }
  Time end_time() const { return times_.back(); }

 private:
  Pose T_map_end_;
  Vector3 gravity_;
  std::vector<Time> times_;
  std::vector<Pose> poses_;          // T_map_imu at times_
  std::vector<Vector3> velocities_;  // map axes
  std::vector<ImuInterval> intervals_;  // interval i lies between times_[i] and times_[i + 1]
};

}  // namespace lodestone
