#pragma once

#include "estimators/estimate.h"

namespace lodestone::testing {

inline constexpr double kStep_s = 0.1;

/// Of one axis of the position; other sigmas are 0.01.
inline Estimate with_sigma(double sigma_m) {
  Estimate estimate;
  estimate.covariance = 1e-4 * Matrix6::Identity();
  estimate.covariance(4, 4) = sigma_m * sigma_m;
  return estimate;
}

}  // namespace lodestone::testing
