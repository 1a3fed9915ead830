#include "core/lidar/lidar_poses.h"

namespace lodestone {

const std::optional<Pose>& LidarPoses::at(Time time) {
  if (time == time_) return T_map_lidar_;
  time_ = time;
  T_map_lidar_ = interpolate(trajectory_, time, max_gap_);
  if (T_map_lidar_) T_map_lidar_ = *T_map_lidar_ * T_imu_lidar_;
  return T_map_lidar_;
}

}  // namespace lodestone
