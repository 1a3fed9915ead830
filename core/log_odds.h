#pragma once

#include <cmath>

namespace lodestone {

/// ln(p / (1 − p)); 1 gives infinity.
inline double log_odds(double probability) {
  return std::log(probability) - std::log1p(-probability);
}

}  // namespace lodestone
