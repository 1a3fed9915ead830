#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/maps/plane_fit.h"
#include "core/option_checks.h"

namespace lodestone {

struct PlaneMapOptions {
  double voxel_m = 0.25;  ///< edge of a voxel; each holds at most one plane
  double margin_m = 0.06;  ///< a voxel's plane is fitted to the points up to so far outside it, too
  double max_thickness_over_median = 1.3;
  PlaneFitOptions fit;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("voxel_m", voxel_m, "edge of a voxel; each holds at most one plane");
    visitor.field("margin_m", margin_m,
                  "a voxel's plane is fitted to the points up to so far outside it, too: more than the map's noise");
    visitor.field("max_thickness_over_median", max_thickness_over_median,
                  "a plane thicker than so many times the map's median holds a piece of something else; 0: no limit");
    visitor.section("fit", fit);
  }

  void check() const {
    option_checks::within("voxel_m", voxel_m, 0.01, 100.0);
    option_checks::within("margin_m", margin_m, 0.0, 0.49 * voxel_m);
    option_checks::not_negative("max_thickness_over_median", max_thickness_over_median);
  }
};

/// The prior cloud map as planes, fitted once, in a voxel hash. Immutable; look-ups are thread-safe and take tens of
/// nanoseconds. A surface that lies in a voxel's face would have its noise cut in two, each half a plane of its own beside
/// the true one; so each voxel is fitted to its points and those within a margin of it. A voxel's plane depends on these
/// alone: maps cut into tiles that overlap by the margin give the same planes.
class PlaneMap {
 public:
  /// Fits a plane to each voxel of `points` (map frame, metres; finite). The result does not depend on threads.
  PlaneMap(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options);

  /// The plane of the voxel that holds `point`; nullptr where there is none.
  const Plane* at(const Eigen::Vector3f& point) const;

  /// The plane for a point that may lie just over a voxel's edge: that of its own voxel; where that voxel holds no points
  /// of the map at all, the closest of those of the three voxels across the nearest faces. nullptr where none is within
  /// `max_distance_m`, and where the point's own voxel holds something that is no plane: an edge between two surfaces
  /// would lend its points to the wrong one.
  const Plane* match(const Eigen::Vector3f& point, float max_distance_m) const;

  const std::vector<Plane>& planes() const { return planes_; }
  const PlaneMapOptions& options() const { return options_; }

  /// Median rms distance of planes' points from them, metres: the survey's noise and the surfaces' roughness.
  double median_thickness_m() const { return median_thickness_m_; }

  /// Voxels that held points but no plane.
  std::int64_t rejected_voxels() const { return rejected_voxels_; }

 private:
  struct Slot {
    std::uint64_t key;
    std::int32_t plane;
  };
  struct Found {
    bool occupied;
    const Plane* plane;
  };
  void build_table(const std::vector<Slot>& slots);
  Found find(const Eigen::Vector3i& voxel) const;

  PlaneMapOptions options_;
  float inverse_voxel_;
  std::vector<Plane> planes_;
  std::vector<Slot> table_;
  std::uint64_t mask_ = 0;
  double median_thickness_m_ = 0.0;
  std::int64_t rejected_voxels_ = 0;
};

}  // namespace lodestone
