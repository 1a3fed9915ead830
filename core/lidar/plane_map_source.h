#pragma once

#include <functional>
#include <memory>

#include "core/geometry/so3.h"

namespace lodestone {

class PlaneMap;
struct Plane;

/// Where estimators get the planes round the robot from: a map wholly in memory, or one of which only tiles are.
class PlaneMapSource {
 public:
  virtual ~PlaneMapSource() = default;

  /// The planes within reach of `position` (map frame, metres); never null. The same object is returned until the robot
  /// has moved on, and a look-up within reach finds the same bits in every one of them. Pointers to planes hold for as
  /// long as the returned map is held.
  virtual std::shared_ptr<const PlaneMap> around(const Vector3& position) const = 0;

  /// Edge of a voxel, metres.
  virtual double voxel_m() const = 0;

  /// Called with a voxel's integer coordinates and its plane, null where its points are none.
  using VoxelVisitor = std::function<void(const Eigen::Vector3i& voxel, const Plane* plane)>;

  /// Visits every voxel of the whole map that holds points, in an order that depends on how the map is held. A plane is
  /// there for the length of the call only. Throws InputError where a map in tiles cannot be read.
  virtual void for_each_voxel(const VoxelVisitor& visit) const = 0;
};

}  // namespace lodestone
