#pragma once

#include <algorithm>
#include <cmath>

namespace lodestone {

/// ln((1 − share) exp(a) + share exp(b)), computed from the larger term.
inline double log_mixture(double share, double a, double b) {
  const double first = std::log1p(-share) + a;
  const double second = std::log(share) + b;
  return std::max(first, second) + std::log1p(std::exp(-std::abs(first - second)));
}

}  // namespace lodestone
