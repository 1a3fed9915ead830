#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/lidar/plane_map_source.h"
#include "core/lidar/plane_thickness.h"
#include "core/lidar/voxel_planes.h"

namespace lodestone {

/// The prior cloud map as planes, fitted once, in a voxel hash. Immutable; look-ups are thread-safe and take tens of
/// nanoseconds. Each voxel is fitted to its points and those within a margin, so that a wall in a voxel's face is not
/// cut into two half planes (docs/design/001). A voxel's plane depends on these points alone: tiles that overlap by the
/// margin give the same planes. A map in memory is its own PlaneMapSource.
class PlaneMap final : public PlaneMapSource, public std::enable_shared_from_this<PlaneMap> {
 public:
  /// Fits a plane to each voxel of `points` (map frame, metres; finite). The result does not depend on threads.
  PlaneMap(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options);

  /// A part of a map. `thickness`: of the planes of the whole map. `voxels`: of all tiles of the part, in any order.
  PlaneMap(std::span<const VoxelPlane> voxels, const PlaneThickness& thickness, const PlaneMapOptions& options);

  /// This map, which must be owned by a shared_ptr.
  std::shared_ptr<const PlaneMap> around(const Vector3&) const override { return shared_from_this(); }

  double voxel_m() const override { return options_.voxel_m; }
  void for_each_voxel(const VoxelVisitor& visit) const override;

  /// The plane of the voxel that contains `point`; nullptr if there is none.
  const Plane* at(const Eigen::Vector3f& point) const;

  /// The plane for a point that may lie just beyond a voxel's edge: that of its own voxel. If that voxel contains no
  /// points of the map, the closest plane of the three voxels across the nearest faces. nullptr if no plane is within
  /// `max_distance_m`, and if the point's own voxel contains points but no plane, as at an edge between two surfaces.
  /// Also nullptr if the same surface would not be found a margin nearer or farther along the normal: matches must not
  /// depend on the point's noise (docs/design/002).
  const Plane* match(const Eigen::Vector3f& point, float max_distance_m) const;

  /// match() of each point. Memory is read for several points at once, instead of after each other. `planes`: one per
  /// point.
  void match(std::span<const Eigen::Vector3f> points, float max_distance_m, std::span<const Plane*> planes) const;

  /// Whether a point is where the map has something: within `distance_m` of the plane that `match` finds, or in a voxel
  /// with points that are no plane.
  bool agrees(const Eigen::Vector3f& point, float distance_m) const;

  const std::vector<Plane>& planes() const { return planes_; }
  const PlaneMapOptions& options() const { return options_; }

  /// Of the planes of the whole map: the survey's noise and the roughness of surfaces.
  const PlaneThickness& thickness() const { return thickness_; }

 private:
  struct Slot {
    std::uint64_t key;
    std::int32_t plane;
  };
  struct Found {
    bool occupied;
    const Plane* plane;
  };
  void insert(std::span<const VoxelPlane> voxels);
  struct Address {
    std::uint64_t key;
    std::uint64_t slot;
  };
  struct Sides {
    Eigen::Vector3f foot;  // of the point on the plane
    std::array<Address, 3> others;
    int count;
  };
  Sides sides_of(const Plane& plane, const Eigen::Vector3i& voxel, const Eigen::Vector3f& point) const;
  bool serves_both_sides(const Plane& plane, const Sides& sides) const;
  std::uint64_t first_slot(std::uint64_t key) const;
  Address address_of(const Eigen::Vector3i& voxel) const;
  Found find(Address address) const;
  const Plane* candidate(const Found& own, Eigen::Vector3i& voxel, const Eigen::Vector3f& point,
                         float max_distance_m) const;

  PlaneMapOptions options_;
  float inverse_voxel_;
  std::vector<Plane> planes_;
  std::vector<Slot> table_;
  std::uint64_t mask_ = 0;
  PlaneThickness thickness_;
};

}  // namespace lodestone
