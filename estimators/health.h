#pragma once

#include <cmath>

#include "estimators/estimate.h"

namespace lodestone {

/// Lost: no finite state, or a position known to worse than 3 m in some direction. Degenerate: LiDAR missed a direction.
inline Health judge(const Estimate& estimate) {
  const double variance = estimate.covariance.diagonal().tail<3>().maxCoeff();
  if (!estimate.state.T_map_imu.position.allFinite() || !(variance < 9.0)) return Health::lost;
  return estimate.diagnostics.degenerate_directions > 0 ? Health::degenerate : Health::good;
}

}  // namespace lodestone
