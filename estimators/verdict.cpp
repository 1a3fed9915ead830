#include "estimators/verdict.h"

namespace lodestone {

Verdict judge_covariance(const Estimate& estimate) {
  const double variance_m2 = position_variance_m2(estimate.covariance);
  if (!estimate.state.T_map_imu.position.allFinite() || !estimate.covariance.allFinite()) {
    return {Health::lost, HealthReason::not_finite};
  }
  if (variance_m2 > kLostSigma_m * kLostSigma_m) return {Health::lost, HealthReason::covariance};
  if (variance_m2 > kUncertainSigma_m * kUncertainSigma_m) return {Health::uncertain, HealthReason::covariance};
  return {};
}

}  // namespace lodestone
