#pragma once

#include <vector>

#include "estimators/estimate.h"

namespace lodestone {

/// Consecutive scans without a usable pose.
struct LostInterval {
  Time from = 0;  ///< first and last of these scans
  Time to = 0;
  bool regained = false;  ///< a usable pose follows
};

/// Collects intervals from estimates in order of time.
class LostIntervals {
 public:
  /// Whether the estimate is usable.
  bool add(const Estimate& estimate) {
    const bool lost = estimate.health == Health::lost;
    if (lost && was_lost_) {
      intervals_.back().to = estimate.time;
    } else if (lost) {
      intervals_.push_back({estimate.time, estimate.time, false});
    } else if (was_lost_) {
      intervals_.back().regained = true;
    }
    was_lost_ = lost;
    return !lost;
  }

  const std::vector<LostInterval>& all() const { return intervals_; }

 private:
  std::vector<LostInterval> intervals_;
  bool was_lost_ = false;
};

}  // namespace lodestone
