#pragma once

#include "estimators/estimate.h"

namespace lodestone {

struct Verdict {
  Health health = Health::good;
  HealthReason reason = HealthReason::none;
};

/// Position sigma on the worst axis above which an estimate is uncertain, and lost.
inline constexpr double kUncertainSigma_m = 0.5;
inline constexpr double kLostSigma_m = 3.0;

/// What state and covariance alone show: not finite, or a position sigma above 3 m: lost; above 0.5 m: uncertain.
Verdict judge_covariance(const Estimate& estimate);

}  // namespace lodestone
