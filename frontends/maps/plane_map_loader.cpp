#include "frontends/maps/plane_map_loader.h"

#include <fmt/format.h>

#include <optional>
#include <vector>

#include "core/error.h"
#include "frontends/maps/tiled_plane_map.h"
#include "frontends/readers/point_cloud_file.h"

namespace lodestone {

namespace {

/// Beyond the LiDAR's range: what a robot drives during a scan, as its points are moved to the scan's end, and a voxel.
constexpr double kBeyondRange = 10.0;

/// How far from the robot planes may be looked for.
double reach_of(const PlaneMapOptions& options, const LidarModel& lidar) {
  const double needed = lidar.max_range_m + lidar.T_imu_lidar.position.norm() + kBeyondRange;
  if (options.resident_radius_m == 0.0) return needed;
  const double reach = options.resident_radius_m - 0.5 * options.tile_m - options.voxel_m;
  if (reach < needed) {
    throw InputError(fmt::format("lidar.map.resident_radius_m: expected at least {:.1f} m (the LiDAR's range of {} m, {} m "
                                 "beyond it and half a tile), found {}; raise it or leave it 0",
                                 needed + options.resident_radius_m - reach, lidar.max_range_m, kBeyondRange,
                                 options.resident_radius_m));
  }
  return reach;
}

}  // namespace

LoadedPlanes load_planes(const std::string& path, const PlaneMapOptions& options, const LidarModel& lidar,
                         const std::string& folder, WarningLog& warnings) {
  const double reach = reach_of(options, lidar);
  std::vector<Eigen::Vector3f> points;
  std::optional<TiledPlaneMapBuilder> builder;
  stream_point_cloud(path, warnings, [&](std::span<const Eigen::Vector3f> piece) {
    if (!builder && points.size() + piece.size() > static_cast<std::size_t>(options.tile_above_points)) {
      builder.emplace(options, folder);
      builder->add(points);
      std::vector<Eigen::Vector3f>().swap(points);
    }
    if (builder) {
      builder->add(piece);
    } else {
      points.insert(points.end(), piece.begin(), piece.end());
    }
  });
  if (!builder) {
    const auto map = std::make_shared<const PlaneMap>(points, options);
    return {map, fmt::format("{} planes", map->planes().size())};
  }
  const auto map = builder->build(reach);
  return {map, fmt::format("{} planes in {} tiles of {:g} m; those within {:.0f} m of the robot are in memory", map->planes(),
                           map->tiles(), map->tile_m(), map->resident_radius_m())};
}

}  // namespace lodestone
