#pragma once

#include <vector>

#include "core/geometry/trajectory.h"
#include "estimators/estimator.h"

namespace lodestone {

/// What one run gave, kept for the figures and pictures at its end: about 1 kB a scan.
class EstimateRecord : public EstimateSink {
 public:
  struct Step {
    Time time = 0;
    Health health = Health::good;
    Diagnostics diagnostics;
  };

  void causal(const Estimate& estimate) override { steps_.push_back({estimate.time, estimate.health, estimate.diagnostics}); }

  void best(const Estimate& estimate) override {
    best_.push_back({estimate.time, estimate.state.T_map_imu});
    covariances_.push_back(estimate.covariance);
  }

  const std::vector<Step>& steps() const { return steps_; }              ///< one a scan, of the causal estimate
  const Trajectory& best() const { return best_; }                       ///< T_map_imu at scan ends
  const std::vector<Matrix6>& covariances() const { return covariances_; }  ///< of the best, in their order

 private:
  std::vector<Step> steps_;
  Trajectory best_;
  std::vector<Matrix6> covariances_;
};

}  // namespace lodestone
