#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace lodestone {

/// The median; of an even number of values the upper one of the middle two. Takes a copy, which it reorders. At least
/// one value.
template <class Number>
Number middle_value(std::vector<Number> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace lodestone
