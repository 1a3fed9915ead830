#pragma once

#include <span>
#include <vector>

#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Range limits of a LiDAR, from its own origin.
struct RangeLimits {
  Eigen::Vector3f origin;  ///< of the LiDAR, in the frame of the first LiDAR, metres
  float min_squared;       ///< m²
  float max_squared;       ///< m²

  /// Whether a point of this LiDAR is within the limits; false if the point is not finite.
  bool hold(const LidarPoint& point) const {
    const float squared = (point.position - origin).squaredNorm();
    return squared >= min_squared && squared <= max_squared;
  }
};

/// The limits by LidarPoint::lidar.
inline std::vector<RangeLimits> range_limits_of(std::span<const LidarModel> lidars) {
  const auto square = [](double value) { return static_cast<float>(value * value); };
  std::vector<RangeLimits> result;
  for (const LidarModel& lidar : lidars) {
    const Vector3 origin =
        result.empty() ? Vector3::Zero() : lidars.front().T_imu_lidar.inverse() * lidar.T_imu_lidar.position;
    result.push_back({origin.cast<float>(), square(lidar.min_range_m), square(lidar.max_range_m)});
  }
  return result;
}

}  // namespace lodestone
