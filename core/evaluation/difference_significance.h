#pragma once

#include "core/magnetometer/magnetic_difference.h"

namespace lodestone {

/// Test whether two maps differ by more than their errors. At a node the test statistic is
///   χ² = Σ_k ((ΔB_k − common_k) / (scale_k σ))²,  3 degrees of freedom,
/// with σ of both maps. A site has many nodes, correlated with their neighbours. The probability that χ² exceeds a
/// value anywhere is the expected Euler characteristic of the excursion set of a χ² field (Worsley 1994, Advances in
/// Applied Probability 26, pages 13-42), or the sum over all nodes if that is less.
struct DifferenceSignificance {
  /// Median of ΔB: the magnetometers' offsets differ between the surveys. Moved steel changes single places only.
  Vector3 common_ut = Vector3::Zero();
  /// Sigma of each component over σ: as the maps state it (sigma_shares), or the spread of most nodes if that is larger
  /// by two standard errors. This is the empirical null (Efron 2004), from the median of absolute values.
  Vector3 scale = Vector3::Ones();
  double nodes = 0.0;      ///< that were compared, all layers
  double half_edge = 0.0;  ///< half of the compared region's outline, in correlation lengths 1 / √roughness
  double area = 0.0;       ///< of the compared region, in squares of such lengths
  double regions = 0.0;    ///< Euler characteristic of the compared region

  /// χ² of a node (ΔB, σ); NaN where nothing was compared. If σ is 0, any change is significant.
  double chi_square(const Eigen::Vector4f& node) const;

  /// Probability that two maps of an unchanged site have a node with at least this χ².
  double p_value(double chi_square) const;

  /// The χ² whose p_value is `probability`.
  double critical(double probability) const;
};

DifferenceSignificance significance_of(const MagneticDifference& difference);

}  // namespace lodestone
