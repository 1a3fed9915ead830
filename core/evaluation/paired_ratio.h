#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace lodestone {

/// The t with P(T ≤ t) = `probability` of Student's distribution. Throws std::invalid_argument if there is less than
/// one degree of freedom, or if the probability is not between 0 and 1.
double student_t_quantile(std::size_t degrees_of_freedom, double probability);

/// The ratio of two quantities, estimated from pairs measured under the same conditions.
struct RatioEstimate {
  std::size_t pairs = 0;
  double ratio = 1.0;         ///< geometric mean
  std::optional<double> low;  ///< of the confidence interval; nothing for a single pair
  std::optional<double> high;
};

/// Geometric mean of positive ratios, and its interval exp(mean ± t s / √n) from the n logarithms: s is their standard
/// deviation (n − 1), t Student's quantile with n − 1 degrees of freedom. Logarithms, because localization errors of
/// different logs differ by factors. Throws std::invalid_argument if there are no ratios, or if one is not positive
/// and finite.
RatioEstimate estimate_ratio(const std::vector<double>& ratios, double confidence = 0.95);

}  // namespace lodestone
