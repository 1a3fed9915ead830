#pragma once

#include <cmath>

#include "estimators/estimate.h"

namespace lodestone {

/// Lost: the state is not finite, or the largest position sigma exceeds 3 m. Degenerate: at least one direction that
/// LiDAR does not observe.
inline Health judge(const Estimate& estimate) {
  const double variance = estimate.covariance.diagonal().tail<3>().maxCoeff();
  if (!estimate.state.T_map_imu.position.allFinite() || !(variance < 9.0)) return Health::lost;
  return estimate.diagnostics.degenerate_directions > 0 ? Health::degenerate : Health::good;
}

/// Detects a wrong pose from the field, where LiDAR does not observe all directions. At a wrong pose the covariance
/// stays small, because some readings fit by chance. Huber weights show it: they are near 1 only if readings agree with
/// the map. Lost: their mean over a few seconds is below one half. Without readings on the map, the mean does not
/// change; the growing covariance detects this case. Source: docs/design/018-magnetometer-faults.md.
class FieldAgreement {
 public:
  /// `step_s`: time since the previous step.
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
