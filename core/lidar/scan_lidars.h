#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The LiDARs that measured the points of a scan. A point has the noise and the origin of its own LiDAR.
struct ScanLidars {
  /// All points are those of one LiDAR.
  ScanLidars(const LidarModel& only) : models{only} {}

  /// `lidars`: by LidarPoint::lidar. Throws std::invalid_argument if a point has an index beyond them.
  ScanLidars(std::vector<LidarModel> lidars, std::span<const LidarPoint> points);

  std::vector<LidarModel> models;
  std::vector<std::uint8_t> of_points;  ///< each point's index in `models`; empty: all points are those of the first
};

}  // namespace lodestone
