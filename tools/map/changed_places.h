#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/evaluation/difference_significance.h"

namespace lodestone {

/// A connected place where two magnetic maps differ.
struct ChangedPlace {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< mean of its nodes, map x, y
  double area_m2 = 0.0;
  double mean_ut = 0.0;  ///< of |ΔB|; each node counts with its largest layer
  double largest_ut = 0.0;
  Vector3 largest_at = Vector3::Zero();  ///< map
  double sigma_ut = 0.0;                 ///< of one component of the change at largest_at, by both maps
  double p_value = 1.0;  ///< that an unchanged site shows such a χ² anywhere; of the place's largest χ²
};

/// Connected places (8-neighbourhood) of nodes with |ΔB| above the threshold and a p-value of at most `level`, the
/// largest change first. Throws InputError if the maps have more than 2^28 nodes in common.
std::vector<ChangedPlace> changed_places(const MagneticDifference& difference,
                                         const DifferenceSignificance& significance, double threshold_ut, double level);

}  // namespace lodestone
