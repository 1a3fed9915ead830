#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/so3.h"

namespace lodestone {

/// Where a series' mean steps the most.
struct LargestStep {
  Vector3 step = Vector3::Zero();  ///< mean after less mean before
  double sigma = 0.0;              ///< of its components, from the series' own robust spread
  std::size_t index = 0;           ///< first value after it; 0: the series is too short

  double sigmas() const { return sigma > 0.0 ? step.norm() / sigma : 0.0; }
};

/// Tries every split with at least `least_side` values on either side. Values as independent of each other.
LargestStep largest_step(std::span<const Vector3> series, std::size_t least_side);

}  // namespace lodestone
