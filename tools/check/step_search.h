#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/so3.h"

namespace lodestone {

/// The largest step of a series' mean.
struct LargestStep {
  Vector3 step = Vector3::Zero();  ///< mean after minus mean before
  double sigma = 0.0;              ///< per component, from the series' robust standard deviation
  std::size_t index = 0;           ///< first value after the step; 0: the series is too short

  double sigmas() const { return sigma > 0.0 ? step.norm() / sigma : 0.0; }
};

/// Tests every split with at least `least_side` values on both sides. Assumes independent values.
LargestStep largest_step(std::span<const Vector3> series, std::size_t least_side);

}  // namespace lodestone
