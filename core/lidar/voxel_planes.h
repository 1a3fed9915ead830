#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/lidar/plane_fit.h"
#include "core/option_checks.h"

namespace lodestone {

struct PlaneMapOptions {
  double voxel_m = 0.25;   ///< edge of a voxel; each has at most one plane
  double margin_m = 0.06;  ///< a voxel's plane is also fitted to points up to this far outside
  double max_thickness_over_median = 1.3;
  PlaneFitOptions fit;
  int tile_above_points = 10000000;
  double tile_m = 32.0;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("voxel_m", voxel_m, "edge of a voxel; each voxel has at most one plane");
    visitor.field(
        "margin_m", margin_m,
        "a voxel's plane is also fitted to points up to this far outside the voxel; more than the map's noise");
    visitor.field("max_thickness_over_median", max_thickness_over_median,
                  "a plane thicker than this many times the median is rejected, as it contains a part of another "
                  "surface; in a map of uneven noise, the limit is three standard deviations of the planes' thickness; "
                  "0: no limit");
    visitor.section("fit", fit);
    visitor.field(
        "tile_above_points", tile_above_points,
        "a cloud of more points is divided into tiles, and only tiles near the robot are in memory; the results are "
        "the same");
    visitor.field("tile_m", tile_m, "edge of a tile, rounded to whole voxels");
  }

  void check() const {
    option_checks::within("voxel_m", voxel_m, 0.01, 100.0);
    option_checks::within("margin_m", margin_m, 0.0, 0.49 * voxel_m);
    option_checks::not_negative("max_thickness_over_median", max_thickness_over_median);
    option_checks::not_negative("tile_above_points", tile_above_points);
    option_checks::within("tile_m", tile_m, voxel_m, 10000.0);
  }
};

/// The integer coordinates of the voxel that contains `point`: floor(point · inverse_voxel). They must be in the range
/// of int: readers of clouds and scans discard points beyond 131 km.
inline Eigen::Vector3i voxel_of(const Eigen::Vector3f& point, float inverse_voxel) {
  return (point * inverse_voxel).array().floor().cast<int>();
}

/// Voxels are numbered up to this count on either side of the origin, on each axis.
constexpr int voxels_to_a_side = 1 << 20;

/// Points up to here, m, on each axis, lie in numbered voxels.
constexpr double voxels_reach_m(double voxel_m) {
  return (voxels_to_a_side - 1) * voxel_m;
}

/// One number per voxel, in the order x, y, z. Voxels are numbered to ±2²⁰ on each axis.
std::uint64_t voxel_key(const Eigen::Vector3i& voxel);

/// The voxel with this number.
Eigen::Vector3i voxel_of_key(std::uint64_t key);

/// A range of voxels, both ends included.
struct VoxelRange {
  Eigen::Vector3i low;
  Eigen::Vector3i high;
};

/// The voxels whose planes a point belongs to: those whose box, grown by the margin, contains it.
class VoxelMembership {
 public:
  /// Throws std::invalid_argument if the voxel or its margin (less than half a voxel) is out of range.
  explicit VoxelMembership(const PlaneMapOptions& options);

  VoxelRange of(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f scaled = point * inverse_voxel_;
    return {(scaled.array() - margin_).floor().cast<int>(), (scaled.array() + margin_).floor().cast<int>()};
  }

 private:
  float inverse_voxel_;
  float margin_;
};

/// A voxel that contains points of the map, and their plane.
struct VoxelPlane {
  std::uint64_t key = 0;
  std::int32_t is_flat = 0;  ///< 0: the points form no plane, `plane` is empty
  Plane plane;
};

/// Fits a plane to each voxel of `points` (map frame, metres; finite) for which `wanted` is true (null: all), ordered
/// by key. A voxel's plane depends only on the points in its grown box, in their order: the same bits whatever else is
/// in `points`, on any number of threads. Voxels without a number (voxels_reach_m) are ignored. The limits of thickness
/// are not yet applied (PlaneLimits). Throws std::invalid_argument for more than 2³¹ − 1 points.
std::vector<VoxelPlane> fit_voxel_planes(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options,
                                         const std::function<bool(const Eigen::Vector3i&)>& wanted = nullptr);

}  // namespace lodestone
