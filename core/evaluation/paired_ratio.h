#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace lodestone {

/// The t with P(T ≤ t) = `probability` of Student's distribution. Throws std::invalid_argument for less than one degree
/// of freedom, or a probability that is not between 0 and 1.
double student_t_quantile(std::size_t degrees_of_freedom, double probability);

/// How many times larger one quantity is than another, from pairs of it measured under the same conditions.
struct RatioEstimate {
  std::size_t pairs = 0;
  double ratio = 1.0;         ///< geometric mean
  std::optional<double> low;  ///< of the confidence interval; nothing where one pair alone tells of no spread
  std::optional<double> high;
};

/// Geometric mean of positive ratios and its interval: exp(mean ± t s / √n) of their n logarithms, s their standard
/// deviation about the mean (n − 1), t Student's quantile with n − 1 degrees of freedom. Errors of localization differ
/// by factors, not by metres, from drive to drive; so do their logarithms' differences by what one normal distribution
/// allows. Throws std::invalid_argument where there are no ratios, or one is not positive and finite.
RatioEstimate estimate_ratio(const std::vector<double>& ratios, double confidence = 0.95);

}  // namespace lodestone
