#pragma once

#include <algorithm>
#include <deque>

#include "core/lidar/map_error.h"

namespace lodestone {

/// The variance of the errors that the cloud map repeats, from the log: scans from places some metres apart are
/// compared (compare_map_errors).
class RepeatedMapError {
 public:
  /// The next scan's, and where it was taken.
  void add(MapError error, const Vector3& position) {
    while (kept_.size() > 1 && (kept_[1].position - position).norm() >= kApart_m) kept_.pop_front();
    if (!kept_.empty() && (kept_.front().position - position).norm() >= kApart_m) {
      if (const auto found = compare_map_errors(kept_.front().error, error)) {
        ++pairs_;
        const double gain = std::max(1.0 / kMemory, 1.0 / pairs_);
        moments_.products_m2 += gain * (found->products_m2 - moments_.products_m2);
        moments_.gains += gain * (found->gains - moments_.gains);
      }
    }
    if (kept_.empty() || (kept_.back().position - position).norm() >= kStep_m) {
      kept_.push_back({position, std::move(error)});
    }
  }

  /// As displacements of the finest cubes alone: an error that scans share over some metres, which is estimated.
  double finest_variance_m2() const { return pairs_ == 0 ? kAtFirst_m * kAtFirst_m : moments_.finest_variance_m2(); }

  /// Of the scales above the finest: errors over tens of metres, which no estimate can tell from the trajectory.
  MapErrorVariances long_variances_m2() const {
    MapErrorVariances result = pairs_ == 0 ? MapErrorVariances::Zero().eval() : moments_.variances_m2();
    result[0] = 0.0;
    return result;
  }

 private:
  // Far enough that the beams meet other planes, near enough that the cubes are the same.
  static constexpr double kApart_m = 2.0;
  static constexpr double kStep_m = 0.5;
  static constexpr double kMemory = 100.0;    // scans that a running mean is of
  static constexpr double kAtFirst_m = 0.01;  // before anything is known: a usual survey's

  struct Kept {
    Vector3 position;
    MapError error;
  };
  std::deque<Kept> kept_;
  MapErrorMoments moments_;
  int pairs_ = 0;
};

}  // namespace lodestone
