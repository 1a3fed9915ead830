#pragma once

#include "core/geometry/nav_state.h"
#include "estimators/options.h"

namespace lodestone {

struct InitialState {
  NavState state;
  Matrix17 covariance;
};

/// The initial state: the given pose and velocity (map axes, m/s), zero biases, gravity along the map's −z, and the
/// uncertainty of `options`.
InitialState initial_state(const Pose& T_map_imu, const Vector3& velocity, double gravity_m_s2,
                           const InitialOptions& options);

}  // namespace lodestone
