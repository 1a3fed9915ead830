#include "frontends/maps/plane_map_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/tiled_plane_map.h"

namespace lodestone {

namespace {

/// Margin beyond the LiDAR's range: motion during a scan, and a voxel.
constexpr double kBeyondRange = 10.0;

/// Keeps points within the range of voxel indices: all points of a site, unless the voxels are very small.
class WithinVoxels {
 public:
  explicit WithinVoxels(double voxel_m) : reach_m_(static_cast<float>(voxels_reach_m(voxel_m))) {}

  std::span<const Eigen::Vector3f> of(std::span<const Eigen::Vector3f> piece) {
    all_ += static_cast<std::int64_t>(piece.size());
    const auto is_far = [this](const Eigen::Vector3f& point) { return point.cwiseAbs().maxCoeff() > reach_m_; };
    if (std::none_of(piece.begin(), piece.end(), is_far)) return piece;
    kept_.clear();
    std::remove_copy_if(piece.begin(), piece.end(), std::back_inserter(kept_), is_far);
    dropped_ += static_cast<std::int64_t>(piece.size() - kept_.size());
    return kept_;
  }

  void finish(const std::string& path, double voxel_m, WarningLog& warnings) const {
    if (dropped_ == 0) return;
    if (2 * dropped_ > all_) {
      throw InputError(fmt::format(
          "{}: {} of {} points are farther than {:.0f} m from the origin, the limit for lidar.map.voxel_m = {:g}; "
          "increase voxel_m, or shift cloud, field map, ground truth and initial pose to an origin at the site",
          path, dropped_, all_, reach_m_, voxel_m));
    }
    warnings.add(
        "cloud.far_points",
        fmt::format(
            "{}: map points farther than {:.0f} m from the origin, the limit for lidar.map.voxel_m = {:g}, were "
            "dropped",
            path, reach_m_, voxel_m),
        0, dropped_);
  }

 private:
  float reach_m_;
  std::vector<Eigen::Vector3f> kept_;
  std::int64_t all_ = 0, dropped_ = 0;
};

}  // namespace

double map_reach_m(std::span<const LidarModel> lidars) {
  double farthest_m = 0.0;
  for (const LidarModel& lidar : lidars)
    farthest_m = std::max(farthest_m, lidar.max_range_m + lidar.T_imu_lidar.position.norm());
  return farthest_m + kBeyondRange;
}

LoadedPlanes load_planes(const std::string& path, const PlaneMapOptions& options, std::span<const LidarModel> lidars,
                         const std::string& folder, WarningLog& warnings, const Vector3& origin_m) {
  const double reach = map_reach_m(lidars);
  std::vector<Eigen::Vector3f> points;
  std::optional<TiledPlaneMapBuilder> builder;
  WithinVoxels within(options.voxel_m);
  const auto add = [&](std::span<const Eigen::Vector3f> all) {
    const std::span<const Eigen::Vector3f> piece = within.of(all);
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
  };
  stream_point_cloud(path, warnings, add, origin_m);
  within.finish(path, options.voxel_m, warnings);
  if (!builder) {
    const auto map = std::make_shared<const PlaneMap>(points, options);
    return {map, std::move(points), fmt::format("{} planes", map->planes().size())};
  }
  const auto map = builder->build(reach);
  return {map,
          {},
          fmt::format("{} planes in {} tiles of {:g} m; those within {:.0f} m of the robot are in memory",
                      map->planes(), map->tiles(), map->tile_m(), map->resident_radius_m())};
}

}  // namespace lodestone
