#include "core/lidar/scan_lidars.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace lodestone {

ScanLidars::ScanLidars(std::vector<LidarModel> lidars, std::span<const LidarPoint> points) : models(std::move(lidars)) {
  const auto is_unknown = [this](const LidarPoint& point) { return point.lidar >= models.size(); };
  if (std::any_of(points.begin(), points.end(), is_unknown)) {
    throw std::invalid_argument("ScanLidars: a point has a LiDAR index outside the sensor suite");
  }
  if (models.size() == 1) return;
  of_points.reserve(points.size());
  for (const LidarPoint& point : points) of_points.push_back(point.lidar);
}

}  // namespace lodestone
