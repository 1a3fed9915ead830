#pragma once

#include <functional>
#include <memory>

#include "core/geometry/so3.h"

namespace lodestone {

class PlaneMap;
struct Plane;

/// Source of the planes around the robot: a map wholly in memory, or a map of which tiles are loaded on demand.
class PlaneMapSource {
 public:
  virtual ~PlaneMapSource() = default;

  /// The planes within reach of `position` (map frame, metres); never null. The same object is returned until the robot
  /// has moved on; look-ups within reach give the same bits in every object. Pointers to planes are valid while the
  /// returned map exists.
  virtual std::shared_ptr<const PlaneMap> around(const Vector3& position) const = 0;

  /// Edge of a voxel, metres.
  virtual double voxel_m() const = 0;

  /// Called with a voxel's integer coordinates and its plane; null if its points form no plane.
  using VoxelVisitor = std::function<void(const Eigen::Vector3i& voxel, const Plane* plane)>;

  /// Visits every voxel of the whole map that contains points; the order depends on the kind of source. The pointer to
  /// a plane is valid during the call only. Throws InputError if a map in tiles cannot be read.
  virtual void for_each_voxel(const VoxelVisitor& visit) const = 0;
};

}  // namespace lodestone
