#pragma once

#include "core/geometry/nav_state.h"
#include "estimators/options.h"

namespace lodestone {

struct InitialState {
  NavState state;
  Matrix17 covariance;
};

/// The state at the log's beginning: the given pose, at rest, without biases, gravity along the map's −z, with the
/// uncertainty of `options`.
InitialState initial_state(const Pose& T_map_imu, double gravity_m_s2, const InitialOptions& options);

}  // namespace lodestone
