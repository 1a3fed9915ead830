#pragma once

#include <cstdint>

#include "core/magnetometer/magnetic_difference.h"

namespace lodestone {

/// How far chance alone lets two magnetic maps of one field differ; docs/design/044-significance-of-map-differences.md.
///
/// If nothing has changed, ΔB over its scaled sigma is a field of three independent standard normal components with
/// correlated neighbours. The distribution of the maximum of |ΔB|² is that of a χ² field of three degrees of freedom:
/// its tail is the expected Euler characteristic of the excursion set (Worsley 1994, Adv. Appl. Prob. 26, 13-42,
/// corollary 3.6), and never more than the number of nodes times the tail at one node (Bonferroni).
class DifferenceSignificance {
 public:
  /// Estimates all from the compared nodes of `difference`. The same bits on any number of threads.
  explicit DifferenceSignificance(const MagneticDifference& difference);

  /// The median of |ΔB| over the stated sigma, divided by the median of a χ variable of three degrees of freedom. 1
  /// where the stated sigmas are right.
  double median_ratio() const { return median_ratio_; }

  /// The stated sigmas are too small by this factor: `median_ratio`, at least 1.
  double sigma_scale() const { return median_ratio_ > 1.0 ? median_ratio_ : 1.0; }

  /// Length scale of the squared-exponential kernel that is as curved at zero as the correlation of the normalized
  /// differences, metres; 0 where the differences are all zero.
  double correlation_length_m() const { return correlation_length_m_; }

  /// The probability that two maps of one field differ somewhere by `stated_sigmas` or more, |ΔB| over the stated sigma
  /// of one component (DifferencePiece::nodes). At most 1; does not increase with `stated_sigmas`.
  double p_value(double stated_sigmas) const;

  /// |ΔB| over the scaled sigma of one component, beyond which `p_value` is at most `level` (between 0 and 1).
  double critical_sigmas(double level) const;

  /// The number of independent places with the same chance of a false one, at the critical value of `level`.
  double independent_places(double level) const;

 private:
  double field_tail(double square) const;

  double median_ratio_ = 1.0;
  double correlation_length_m_ = 0.0;
  std::int64_t nodes_ = 0;  ///< compared, all layers
  bool smooth_ = false;     ///< the correlation is known
  /// Intrinsic volumes of the compared region, in units of the correlation: Euler characteristic, half of the
  /// perimeter, area. Summed over the layers.
  double volumes_[3] = {0.0, 0.0, 0.0};
};

}  // namespace lodestone
