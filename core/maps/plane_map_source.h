#pragma once

#include <memory>

#include "core/geometry/so3.h"

namespace lodestone {

class PlaneMap;

/// Where estimators get the planes round the robot from: a map wholly in memory, or one of which only tiles are.
class PlaneMapSource {
 public:
  virtual ~PlaneMapSource() = default;

  /// The planes within reach of `position` (map frame, metres); never null. The same object is returned until the robot has
  /// moved on, and a look-up within reach finds the same bits in every one of them. Pointers to planes hold for as long as
  /// the returned map is held.
  virtual std::shared_ptr<const PlaneMap> around(const Vector3& position) const = 0;
};

}  // namespace lodestone
