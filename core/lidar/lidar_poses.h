#pragma once

#include <optional>

#include "core/geometry/trajectory.h"

namespace lodestone {

/// Poses of a LiDAR at the times of its points, interpolated on a trajectory: deskewing with known poses. The points of
/// one firing share their time and so their pose.
class LidarPoses {
 public:
  /// `trajectory`: T_map_imu; must outlive this. `max_gap`: ns between neighbouring poses.
  LidarPoses(const Trajectory& trajectory, const Pose& T_imu_lidar, Time max_gap)
      : trajectory_(trajectory), T_imu_lidar_(T_imu_lidar), max_gap_(max_gap) {}

  /// T_map_lidar; empty before the first pose, after the last one, and between poses more than `max_gap` apart. The
  /// reference is valid until the next call.
  const std::optional<Pose>& at(Time time);

 private:
  const Trajectory& trajectory_;
  Pose T_imu_lidar_;
  Time max_gap_;
  std::optional<Time> time_;  ///< of the last call
  std::optional<Pose> T_map_lidar_;
};

}  // namespace lodestone
