#pragma once

#include <span>
#include <vector>

#include "estimators/factory.h"

namespace lodestone {

/// A hypothesis of the initial pose, tracked by the filter.
class StartTrack {
 public:
  /// `pose_at_start`: T_map_imu at the first bundle's scan start, accurate to about 0.2 m; the velocity is unknown.
  StartTrack(const EstimatorInput& input, const Pose& pose_at_start);

  /// Processes further bundles, in order of time, with all points of their scans.
  void follow(std::span<const ScanBundle> bundles);

  /// State at the end of each scan so far.
  const std::vector<NavState>& states() const { return states_; }
  bool lost() const { return lost_; }

 private:
  std::shared_ptr<Estimator> filter_;
  std::vector<NavState> states_;
  bool lost_ = false;
};

}  // namespace lodestone
