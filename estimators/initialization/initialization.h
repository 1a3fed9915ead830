#pragma once

#include "core/geometry/nav_state.h"
#include "estimators/options.h"

namespace lodestone {

struct InitialState {
  NavState state;
  Matrix17 covariance;
};

/// The state at the log's beginning: the given pose and velocity (map axes, m/s), without biases, gravity along the
/// map's −z, with the uncertainty of `options`.
InitialState initial_state(const Pose& T_map_imu, const Vector3& velocity, double gravity_m_s2,
                           const InitialOptions& options);

}  // namespace lodestone
