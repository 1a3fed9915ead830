#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/magnetometer/difference_significance.h"
#include "core/magnetometer/magnetic_difference.h"

namespace lodestone {

/// A connected place where two magnetic maps differ.
struct ChangedPlace {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< mean of its nodes, map x, y
  double area_m2 = 0.0;
  double mean_ut = 0.0;  ///< of |ΔB|, the largest of the layers at each node
  double largest_ut = 0.0;
  Vector3 largest_at = Vector3::Zero();  ///< map
  double sigma_ut = 0.0;                 ///< of one component of ΔB at `largest_at`, from both maps' stated sigmas
  double scaled_sigma_ut = 0.0;          ///< the same, times DifferenceSignificance::sigma_scale
  double most_sigmas = 0.0;              ///< the largest |ΔB| over its scaled sigma of the place's nodes, all layers
  double p_value = 1.0;                  ///< of `most_sigmas`; see DifferenceSignificance::p_value
};

/// Places of nodes with |ΔB| above the threshold that touch, corners included; the largest change first. Chance may
/// have made them: see `p_value`. Throws InputError if the maps share more than 2^28 nodes.
std::vector<ChangedPlace> changed_places(const MagneticDifference& difference,
                                         const DifferenceSignificance& significance, double threshold_ut);

}  // namespace lodestone
