#pragma once

#include <cmath>
#include <cstdint>

#include "core/lidar/voxel_planes.h"

namespace lodestone {

/// The difference in thickness of a map's planes that is due to chance, because each plane has few points. The
/// logarithm of a standard deviation with n − 3 degrees of freedom has a variance of 1 / (2 (n − 3)) (docs/design/039).
/// Sums of integers do not depend on the order.
struct ThicknessChance {
  std::int64_t millionths = 0;
  std::int64_t planes = 0;

  void add(const Plane& plane) {
    millionths += std::llround(0.5e6 / std::max(1.0, static_cast<double>(plane.count) - 3.0));
    ++planes;
  }

  /// The thickness of the map's planes with this chance subtracted: `low_m` moves towards the median.
  PlaneThickness taken_off(double median_m, double low_m) const {
    if (planes == 0 || !(low_m > 0.0)) return {median_m, low_m};
    const double chance = 1e-6 * static_cast<double>(millionths) / static_cast<double>(planes);
    const double uneven = std::max(0.0, std::pow(std::log(median_m / low_m), 2) - chance);
    return {median_m, median_m * std::exp(-std::sqrt(uneven))};
  }
};

}  // namespace lodestone
