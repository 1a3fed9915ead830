#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/lidar/plane_fit.h"
#include "core/option_checks.h"

namespace lodestone {

struct PlaneMapOptions {
  double voxel_m = 0.25;   ///< edge of a voxel; each holds at most one plane
  double margin_m = 0.06;  ///< a voxel's plane is fitted to the points up to so far outside it, too
  double max_thickness_over_median = 1.3;
  PlaneFitOptions fit;
  int tile_above_points = 10000000;
  double tile_m = 32.0;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("voxel_m", voxel_m, "edge of a voxel; each holds at most one plane");
    visitor.field("margin_m", margin_m,
                  "a voxel's plane is fitted to the points up to so far outside it, too: more than the map's noise");
    visitor.field("max_thickness_over_median", max_thickness_over_median,
                  "in a map of even noise, a plane thicker than this many times the median contains a piece of another "
                  "surface; in a map of uneven noise the limit is three times the spread of thickness; 0: no limit");
    visitor.section("fit", fit);
    visitor.field(
        "tile_above_points", tile_above_points,
        "a cloud of more points is cut into tiles, of which only those round the robot are in memory; the results "
        "are the same");
    visitor.field("tile_m", tile_m, "edge of such a tile, rounded to whole voxels");
  }

  void check() const {
    option_checks::within("voxel_m", voxel_m, 0.01, 100.0);
    option_checks::within("margin_m", margin_m, 0.0, 0.49 * voxel_m);
    option_checks::not_negative("max_thickness_over_median", max_thickness_over_median);
    option_checks::not_negative("tile_above_points", tile_above_points);
    option_checks::within("tile_m", tile_m, voxel_m, 10000.0);
  }
};

/// The integer coordinates of the voxel that holds `point`: floor(point · inverse_voxel).
inline Eigen::Vector3i voxel_of(const Eigen::Vector3f& point, float inverse_voxel) {
  return (point * inverse_voxel).array().floor().cast<int>();
}

/// Voxels have numbers up to so many to either side of the origin, on each axis.
constexpr int voxels_to_a_side = 1 << 20;

/// Points up to here, m, on each axis, lie in voxels that have numbers.
constexpr double voxels_reach_m(double voxel_m) {
  return (voxels_to_a_side - 1) * voxel_m;
}

/// One number a voxel, in the order x, y, z. Voxels count to ±2²⁰ on each axis.
std::uint64_t voxel_key(const Eigen::Vector3i& voxel);

/// The voxel whose number this is.
Eigen::Vector3i voxel_of_key(std::uint64_t key);

/// A range of voxels, both ends within.
struct VoxelRange {
  Eigen::Vector3i low;
  Eigen::Vector3i high;
};

/// The voxels to whose planes a point belongs: those whose box, grown by the margin, holds it.
class VoxelMembership {
 public:
  /// Throws std::invalid_argument where the voxel or its margin (less than half a voxel) is out of range.
  explicit VoxelMembership(const PlaneMapOptions& options);

  VoxelRange of(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f scaled = point * inverse_voxel_;
    return {(scaled.array() - margin_).floor().cast<int>(), (scaled.array() + margin_).floor().cast<int>()};
  }

 private:
  float inverse_voxel_;
  float margin_;
};

/// A voxel that holds points of the map, and the plane that they make.
struct VoxelPlane {
  std::uint64_t key = 0;
  std::int32_t is_plane = 0;  ///< 0: the points are no plane, `plane` is empty
  Plane plane;
};

/// Fits a plane to each voxel of `points` (map frame, metres; finite) for which `wanted` holds (null: all), ordered by
/// key. A voxel's plane depends on the points of its grown box in their order alone: the same bits whatever else
/// `points` holds, on any number of threads. Voxels without a number (voxels_reach_m) are left out. No limit of
/// thickness over the median is applied yet.
std::vector<VoxelPlane> fit_voxel_planes(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options,
                                         const std::function<bool(const Eigen::Vector3i&)>& wanted = nullptr);

/// How thick the planes of a whole map are (rms distance of their points, m). Sensors, surfaces and range make some
/// maps uneven; the lower half shows it, because voxels at edges are thick for another reason.
struct PlaneThickness {
  double median_m = 0.0;
  double low_m = 0.0;  ///< one standard deviation below the median: the value of rank 0.159

  /// One standard deviation of the logarithm.
  double log_spread() const;
};

/// Ranks of the median and of `low_m` among so many sorted values.
constexpr std::size_t median_rank(std::size_t count) {
  return count / 2;
}
constexpr std::size_t low_rank(std::size_t count) {
  return count * 159 / 1000;
}

/// Largest thickness that a map's planes may have: where floor meets wall a voxel may hold a strip of the other surface
/// too thin to reject by itself. It stands out against the thickness of the map's planes, by three standard deviations.
double thickness_limit(const PlaneThickness& thickness, const PlaneMapOptions& options);

/// `plane` with the variances that its points' noise gives it, where that is taken from the map's planes and its own
/// points together: the mean a posteriori under the conjugate prior of at most 30 degrees of freedom, fewer where the
/// map's planes differ by more than so many points let them (Smyth, Statistical Applications in Genetics and Molecular
/// Biology 2004). Of eight points alone one variance in three is too small by a third, and the plane weighs the more
/// for it. The prior is corrected for the three fitted parameters as if it came from as many points as the plane has:
/// one with fewer than is usual in its map, at the edge of what the survey saw, is trusted the less. A thickness of
/// exactly zero is left as it is.
Plane with_shared_thickness(Plane plane, const PlaneThickness& thickness);

}  // namespace lodestone
