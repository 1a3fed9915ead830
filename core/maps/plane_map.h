#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/maps/plane_fit.h"

namespace lodestone {

struct PlaneMapOptions {
  double voxel_m = 0.25;  ///< edge of a voxel; each holds at most one plane
  PlaneFitOptions fit;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("voxel_m", voxel_m, "edge of a voxel; each holds at most one plane");
    visitor.section("fit", fit);
  }
};

/// The prior cloud map as planes, fitted once, in a voxel hash. Immutable; look-ups are thread-safe and take tens of
/// nanoseconds. A voxel's plane depends on that voxel's points alone, so maps cut into tiles give the same planes.
class PlaneMap {
 public:
  /// Fits a plane to each voxel of `points` (map frame, metres; finite). The result does not depend on threads.
  PlaneMap(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options);

  /// From planes already fitted, one for each voxel.
  PlaneMap(std::vector<Plane> planes, const PlaneMapOptions& options);

  /// The plane of the voxel that holds `point`; nullptr where there is none.
  const Plane* at(const Eigen::Vector3f& point) const;

  /// The plane for a point that may lie just over a voxel's edge: that of its own voxel if the point is within
  /// `max_distance_m` of it, else the closest of those of the three voxels across the nearest faces. nullptr if none.
  const Plane* match(const Eigen::Vector3f& point, float max_distance_m) const;

  const std::vector<Plane>& planes() const { return planes_; }
  const PlaneMapOptions& options() const { return options_; }

  /// Voxels that held points but no plane.
  std::int64_t rejected_voxels() const { return rejected_voxels_; }

 private:
  struct Slot {
    std::uint64_t key;
    std::int32_t plane;
  };
  void build_table();
  const Plane* find(const Eigen::Vector3i& voxel) const;

  PlaneMapOptions options_;
  float inverse_voxel_;
  std::vector<Plane> planes_;
  std::vector<Slot> table_;
  std::uint64_t mask_ = 0;
  std::int64_t rejected_voxels_ = 0;
};

}  // namespace lodestone
