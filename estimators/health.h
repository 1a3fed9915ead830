#pragma once

#include <cmath>

#include "estimators/estimate.h"

namespace lodestone {

/// Lost: no finite state, or a position known to worse than 3 m in some direction. Degenerate: LiDAR missed a
/// direction.
inline Health judge(const Estimate& estimate) {
  const double variance = estimate.covariance.diagonal().tail<3>().maxCoeff();
  if (!estimate.state.T_map_imu.position.allFinite() || !(variance < 9.0)) return Health::lost;
  return estimate.diagnostics.degenerate_directions > 0 ? Health::degenerate : Health::good;
}

/// Whether the field, which is all there is without LiDAR, still agrees with its map. A pose in the wrong place fits
/// some reading or other and so keeps a small covariance: that covariance cannot tell that it is lost, but Huber's
/// weights do, which are near 1 as long as the readings are what map and prediction say. Their mean over the last few
/// seconds below one half is lost. Without readings on the map nothing is judged here: then the covariance grows.
class FieldAgreement {
 public:
  /// `step_s`: since the step before.
  void add(const Diagnostics& diagnostics, double step_s) {
    if (diagnostics.magnetic_samples == 0) return;
    constexpr double kMemory_s = 3.0;
    mean_ += (1.0 - std::exp(-step_s / kMemory_s)) * (diagnostics.magnetic_weight - mean_);
  }

  bool lost() const { return mean_ < 0.5; }

 private:
  double mean_ = 1.0;
};

}  // namespace lodestone
