#include "frontends/lidar/scan_sampling.h"

#include <cmath>
#include <cstdint>

namespace lodestone {

namespace {

std::uint64_t voxel_key(const Eigen::Vector3f& point, float inverse_voxel) {
  // Twenty-one bits an axis hold any range of a LiDAR at any sensible voxel.
  const auto part = [&](float value) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(value * inverse_voxel)) + (1 << 20)) &
           ((1U << 21) - 1U);
  };
  return part(point.x()) << 42 | part(point.y()) << 21 | part(point.z());
}

}  // namespace

std::vector<LidarPoint> sample_scan(const LidarScan& scan, const LidarModel& lidar,
                                    const ScanSamplingOptions& options) {
  const float min_squared = static_cast<float>(lidar.min_range_m * lidar.min_range_m);
  const float max_squared = static_cast<float>(lidar.max_range_m * lidar.max_range_m);
  std::vector<LidarPoint> kept;
  kept.reserve(scan.points.size() / 4 + 16);
  std::size_t capacity = 1024;
  while (capacity < 2 * scan.points.size()) capacity *= 2;
  constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  std::vector<std::uint64_t> seen(options.voxel_m > 0.0 ? capacity : 0, kEmpty);
  const float inverse_voxel = options.voxel_m > 0.0 ? static_cast<float>(1.0 / options.voxel_m) : 0.0F;
  for (const LidarPoint& point : scan.points) {
    const float squared = point.position.squaredNorm();
    if (!(squared >= min_squared && squared <= max_squared)) continue;  // also drops NaN
    if (options.voxel_m > 0.0) {
      const std::uint64_t key = voxel_key(point.position, inverse_voxel);
      std::uint64_t slot = (key * 0x9E3779B97F4A7C15ULL >> 20) & (capacity - 1);
      while (seen[slot] != kEmpty && seen[slot] != key) slot = (slot + 1) & (capacity - 1);
      if (seen[slot] == key) continue;
      seen[slot] = key;
    }
    kept.push_back(point);
  }
  const std::size_t limit = static_cast<std::size_t>(options.max_points);
  if (options.max_points > 0 && kept.size() > limit) {
    for (std::size_t i = 0; i < limit; ++i) kept[i] = kept[i * kept.size() / limit];
    kept.resize(limit);
  }
  return kept;
}

}  // namespace lodestone
