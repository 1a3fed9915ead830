#include "tools/check/cloud_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/warnings.h"
#include "frontends/maps/point_cloud_file.h"

namespace lodestone {

namespace {

// Limits of warnings. No estimate depends on them.
constexpr double kLeastOnPlanes = 0.5;    // below it, a run uses the smaller part of the map
constexpr double kMostDoubled = 0.05;     // doors and boards count too: one voxel in twenty
constexpr double kMostOfThickness = 0.5;  // median over the thickness at which a plane is rejected

/// Keeps the points of every cube of 8 m until there are too many, then those of every second, fourth and so on. Which
/// ones depends on their numbers alone. Figures of single voxels do not suffer; a share of voxels in a cube's face does
/// by 3 %.
class CubeSample {
 public:
  explicit CubeSample(std::size_t most) : most_(most) {}

  void add(const Eigen::Vector3f& point) {
    if (!is_kept(point)) return;
    points_.push_back(point);
    if (points_.size() <= most_ || mask_ >= (std::uint64_t{1} << 40U)) return;
    mask_ = 2 * mask_ + 1;
    std::erase_if(points_, [this](const Eigen::Vector3f& one) { return !is_kept(one); });
  }

  const std::vector<Eigen::Vector3f>& points() const { return points_; }

 private:
  static constexpr float kCube_m = 8.0F;

  bool is_kept(const Eigen::Vector3f& point) const {
    const Eigen::Vector3i cube = (point / kCube_m).array().floor().cast<int>();
    // The finalizer of MurmurHash3: neighbours differ in every bit.
    std::uint64_t hash = static_cast<std::uint32_t>(cube.x()) * 0x9E3779B97F4A7C15ULL;
    hash = (hash ^ static_cast<std::uint32_t>(cube.y())) * 0xFF51AFD7ED558CCDULL;
    hash = (hash ^ (hash >> 33U) ^ static_cast<std::uint32_t>(cube.z())) * 0xC4CEB9FE1A85EC53ULL;
    return ((hash ^ (hash >> 33U)) & mask_) == 0;
  }

  std::size_t most_;
  std::uint64_t mask_ = 0;
  std::vector<Eigen::Vector3f> points_;
};

Finding warning(const char* kind, std::string seen, std::string change) {
  return {Severity::warning, kind, std::move(seen), std::move(change)};
}

}  // namespace

CloudMeasurement measure_cloud_file(const std::string& path, const PlaneMapOptions& options) {
  CloudMeasurement measured;
  CubeSample sample(static_cast<std::size_t>(options.tile_above_points));
  WarningLog unheard;
  stream_point_cloud(path, unheard, [&](std::span<const Eigen::Vector3f> piece) {
    for (const Eigen::Vector3f& point : piece) {
      if (measured.points++ == 0) measured.low_m = measured.high_m = point;
      measured.low_m = measured.low_m.cwiseMin(point);
      measured.high_m = measured.high_m.cwiseMax(point);
      sample.add(point);
    }
  });
  measured.quality = measure_cloud(sample.points(), options);
  return measured;
}

Findings check_cloud(const CloudMeasurement& measured, const PlaneMapOptions& options, const std::string& path) {
  const CloudQuality& quality = measured.quality;
  Findings findings;
  if (quality.median_points_per_voxel < options.fit.min_points) {
    findings.push_back(
        warning("cloud.sparse",
                fmt::format("{}: half of the voxels of {:g} m contain at most {:.0f} points; a plane requires {}", path,
                            options.voxel_m, quality.median_points_per_voxel, options.fit.min_points),
                "a denser --cloud, or a larger lidar.map.voxel_m in the options of the run; are x, y, z metres?"));
    return findings;  // no plane: nothing else is measured well
  }
  if (quality.median_thickness_m > kMostOfThickness * options.fit.max_thickness_m) {
    findings.push_back(warning(
        "cloud.thick",
        fmt::format("{}: surfaces are {:.0f} mm thick (median; 90th percentile {:.0f} mm); planes above {:.0f} mm are "
                    "rejected",
                    path, 1e3 * quality.median_thickness_m, 1e3 * quality.ninetieth_thickness_m,
                    1e3 * options.fit.max_thickness_m),
        "a --cloud from better registered scans; or raise lidar.map.fit.max_thickness_m and lidar.map.margin_m"));
  }
  if (quality.doubled_share > kMostDoubled) {
    findings.push_back(
        warning("cloud.doubled",
                fmt::format("{}: {:.1f} % of the surface is doubled: two parallel surfaces {:.0f} mm apart (median), "
                            "most of them near ({:.1f} {:.1f} {:.1f})",
                            path, 100.0 * quality.doubled_share, 1e3 * quality.doubled_distance_m,
                            quality.doubled_place_m.x(), quality.doubled_place_m.y(), quality.doubled_place_m.z()),
                "--cloud: register the scans of that place again, or leave one pass out; doors and boards count too"));
  }
  if (quality.on_planes_share < kLeastOnPlanes) {
    findings.push_back(warning("cloud.off_planes",
                               fmt::format("{}: only {:.0f} % of the points lie on planes of voxels of {:g} m", path,
                                           100.0 * quality.on_planes_share, options.voxel_m),
                               "a --cloud with less noise and vegetation; or another lidar.map.voxel_m"));
  }
  return findings;
}

}  // namespace lodestone
