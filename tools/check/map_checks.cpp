#include "tools/check/map_checks.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "core/lidar/double_surfaces.h"
#include "core/middle_value.h"

namespace lodestone {

namespace {

/// Share of flat voxels with two surfaces above which it is a warning. Source: docs/design/047.
constexpr double kManyTwice = 0.05;

/// Voxels of the map along the edge of one in which two surfaces are looked for: four times as many points.
constexpr double kVoxelsAnEdge = 2.0;

}  // namespace

Findings check_map(const PlaneMapSource& map, const PlaneMapOptions& options, std::span<const Eigen::Vector3f> points) {
  std::size_t voxels = 0;
  std::vector<float> thickness_mm;
  std::vector<float> counts;
  map.for_each_voxel([&](const Eigen::Vector3i&, const Plane* plane) {
    ++voxels;
    if (plane == nullptr) return;
    thickness_mm.push_back(1e3F * plane->thickness);
    counts.push_back(static_cast<float>(plane->count));
  });
  if (thickness_mm.empty()) {
    return {{Severity::error, "map.no_planes", fmt::format("none of the cloud's {} voxels holds a plane", voxels),
             "check --cloud: units must be metres; set lidar.map.voxel_m to hold at least six points a surface"}};
  }
  // A plane has the points of its voxel and of the margin on both sides.
  const double area_m2 = std::pow(map.voxel_m() + 2.0 * options.margin_m, 2);
  const auto share = static_cast<double>(thickness_mm.size()) / static_cast<double>(voxels);
  Findings findings;
  findings.push_back(
      {Severity::note, "map.planes",
       fmt::format("{:.0f} % of the cloud's voxels hold a plane ({} of {}); planes are {:.0f} mm thick (half of them "
                   "{:.0f} to {:.0f} mm) and have {:.0f} points per m2",
                   100.0 * share, thickness_mm.size(), voxels, value_at_share(thickness_mm, 0.5),
                   value_at_share(thickness_mm, 0.25), value_at_share(thickness_mm, 0.75),
                   value_at_share(counts, 0.5) / area_m2),
       ""});
  const DoubleSurfaces twice = find_double_surfaces(points, kVoxelsAnEdge * map.voxel_m());
  if (twice.found > 0) {
    const bool many = twice.share() > kManyTwice;
    findings.push_back({many ? Severity::warning : Severity::note, "map.double",
                        fmt::format("{:.1f} % of the cloud's flat places hold two surfaces, {:.0f} mm apart (median; "
                                    "{} of {})",
                                    100.0 * twice.share(), 1e3 * twice.distance_m, twice.found, twice.looked_at),
                        many ? "align the drives of the survey with each other, check T_imu_lidar and the range errors "
                               "of the LiDAR's beams, and make the cloud again"
                             : ""});
  }
  return findings;
}

}  // namespace lodestone
