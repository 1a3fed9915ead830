#pragma once

#include <limits>
#include <vector>

#include "core/evaluation/association.h"

namespace lodestone {

/// How well the reported covariances match the errors. Each nees is the mean of δᵀ P⁻¹ δ over its degrees of freedom,
/// δ = truth ⊟ estimate in tangent order φ (right, body), p (map). 1 is consistent, above 1 is overconfident.
struct Consistency {
  std::size_t count = 0;                ///< poses whose covariance is positive definite
  std::size_t singular = 0;             ///< rejected poses: their covariance is not positive definite
  double nees = 0.0;                    ///< of the pose, 6 degrees of freedom
  double nees_rotation = 0.0;           ///< of φ with its 3×3 block
  double nees_position = 0.0;           ///< of p with its 3×3 block
  Vector6 nees_axis = Vector6::Zero();  ///< of each component: mean of δ_i² / P_ii, order φ, p
  /// 95 % confidence interval of `nees`, from the means of 20 segments of time: errors are correlated in time. Infinite
  /// for fewer than 40 poses.
  double nees_low = 0.0;
  double nees_high = std::numeric_limits<double>::infinity();
  double share_within_95 = 0.0;  ///< share of poses below the 95 % quantile of χ² with 6 degrees of freedom
};

/// `covariances`: one per pair, 6×6, rad² and m². Throws std::invalid_argument if the sizes differ.
Consistency evaluate_consistency(const PosePairs& pairs, const std::vector<Matrix6>& covariances);

}  // namespace lodestone
