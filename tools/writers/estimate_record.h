#pragma once

#include <vector>

#include "core/geometry/trajectory.h"
#include "estimators/estimator.h"
#include "tools/writers/lost_intervals.h"

namespace lodestone {

/// The estimates of one run, kept in memory for figures and pictures: about 1 kB per scan. Poses of scans at which the
/// estimator was lost are not kept.
class EstimateRecord : public EstimateSink {
 public:
  struct Step {
    Time time = 0;
    Health health = Health::good;
    HealthReason reason = HealthReason::none;
    Diagnostics diagnostics;
  };

  /// Poses T_map_imu at scan ends with their covariances (φ, p), in order of time.
  struct Poses {
    Trajectory trajectory;
    std::vector<Matrix6> covariances;

    void add(const Estimate& estimate) {
      trajectory.push_back({estimate.time, estimate.state.T_map_imu});
      covariances.push_back(estimate.covariance);
    }
  };

  void causal(const Estimate& estimate) override {
    steps_.push_back({estimate.time, estimate.health, estimate.reason, estimate.diagnostics});
    if (estimate.health != Health::lost) causal_.add(estimate);
  }
  void smoothed(const Estimate& estimate) override {
    if (estimate.health != Health::lost) smoothed_.add(estimate);
  }
  void best(const Estimate& estimate) override {
    if (lost_.add(estimate)) best_.add(estimate);
  }

  const std::vector<Step>& steps() const { return steps_; }  ///< one per scan, of the causal estimate
  const Trajectory& best() const { return best_.trajectory; }
  const std::vector<Matrix6>& covariances() const { return best_.covariances; }  ///< of the best estimate

  const Poses& causal_poses() const { return causal_; }
  const Poses& smoothed_poses() const { return smoothed_; }  ///< empty without a batch refinement
  const Poses& best_poses() const { return best_; }

  /// Intervals without a best pose.
  const std::vector<LostInterval>& lost() const { return lost_.all(); }

 private:
  std::vector<Step> steps_;
  Poses causal_;
  Poses smoothed_;
  Poses best_;
  LostIntervals lost_;
};

}  // namespace lodestone
