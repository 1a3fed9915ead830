#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimators/factory.h"

namespace lodestone {

/// How a hypothesis of the initial pose is tracked.
enum class StartTracking {
  filter,
  pairs  ///< scans are registered in pairs (find_motion)
};

/// Pairs if an unknown velocity moves the robot from one of `bundles` to the next further than a registration
/// converges.
StartTracking tracking_of(std::span<const ScanBundle> bundles);

/// A hypothesis of the initial pose, tracked through the scans that follow.
class StartTrack {
 public:
  /// `pose_at_start`: T_map_imu at the first bundle's scan start, accurate to about 0.2 m; the velocity is unknown.
  /// `input` must outlive this if scans are registered in pairs.
  StartTrack(const EstimatorInput& input, const Pose& pose_at_start, StartTracking tracking);

  /// Processes further bundles, in order of time, with all points of their scans. The first has points.
  void follow(std::span<const ScanBundle> bundles);

  /// State at the end of each scan so far. In pairs, a scan may change the states before it.
  const std::vector<NavState>& states() const { return states_; }
  bool lost() const { return lost_; }

 private:
  void follow_in_pairs(const ScanBundle& bundle);

  const EstimatorInput* input_;
  Pose pose_at_start_;
  std::shared_ptr<Estimator> filter_;  // null in pairs
  std::vector<ScanBundle> since_;      // the newest scan that is registered, and what follows
  std::vector<NavState> states_;
  bool lost_ = false;
};

}  // namespace lodestone
