#include "core/mapping/noise_calibration.h"

#include <algorithm>
#include <numeric>

namespace lodestone {
namespace {

/// Trimmed mean of error / (predicted + noise) over the smallest 90 %, divided by its value for a normal distribution.
/// 1 is consistent.
double trimmed_normalized_square(const std::vector<HeldOutError>& errors, double noise) {
  constexpr double share = 0.9;
  constexpr double normal_value = 0.6231;  // of χ² with one degree of freedom, below its 90 % quantile
  std::vector<double> ratios;
  ratios.reserve(errors.size());
  for (const HeldOutError& held_out : errors) ratios.push_back(held_out.error / (held_out.predicted + noise));
  const auto count = static_cast<std::ptrdiff_t>(share * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), ratios.begin() + count, ratios.end());
  std::sort(ratios.begin(), ratios.begin() + count);  // fixed order of summation: the partition depends on the library
  return std::accumulate(ratios.begin(), ratios.begin() + count, 0.0) / static_cast<double>(count) / normal_value;
}

}  // namespace

double calibrated_noise(const std::vector<HeldOutError>& errors, double noise) {
  constexpr double tolerance = 1.2;  // spread of this estimate
  if (trimmed_normalized_square(errors, noise) <= tolerance) return noise;
  double low = noise;
  double high = noise;
  for (const HeldOutError& held_out : errors) high = std::max(high, 4.0 * held_out.error);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (trimmed_normalized_square(errors, middle) > 1.0 ? low : high) = middle;
  }
  return high;
}

SurveySplit split_for_calibration(const std::vector<FieldObservation>& observations, double cell_m, double block_s) {
  SurveySplit split;
  for (const Time period : {96, 48, 24, 12, 5}) {
    split = split_survey(observations, cell_m, from_seconds(block_s), period);
    if (split.held_out.size() >= 1000) break;
  }
  return split;
}

}  // namespace lodestone
