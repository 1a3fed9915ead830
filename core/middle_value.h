#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace lodestone {

/// The median; of an even number of values the upper of the middle two. Reorders its copy. Requires at least one value.
template <class Number>
Number middle_value(std::vector<Number> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value at a share of the way through the sorted values, the lower one between two. Reorders `values`. Requires at
/// least one value.
template <class Number>
Number value_at_share(std::vector<Number>& values, double share) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// The median; of an even number of values the mean of the middle two. Requires at least one value.
inline double median(std::vector<double> values) {
  const double upper = middle_value(values);
  return 0.5 * (value_at_share(values, 0.5) + upper);
}

}  // namespace lodestone
