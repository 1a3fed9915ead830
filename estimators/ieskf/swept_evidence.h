#pragma once

#include <span>

#include "core/imu/deskewing.h"
#include "core/lidar/condensed_cost.h"
#include "estimators/ieskf/iterated_update.h"

namespace lodestone {

/// What a scan says of the pose, its points as they are. `mask`: as below.
PoseEvidence masked_evidence(const CondensedCost& cost, const Pose& T_map_imu, const Matrix6& mask);

/// What a deskewed scan says of the state at its end. Points were displaced by what the velocity, the biases and
/// gravity were wrong by: a point of age t by t δv, t δb_g and t²/2 δa. The noise of the IMU within the step is
/// marginalized. `cost`: condensed from `correspondences` at `condensed_at`. `deskewed`: the state of `deskewing`.
/// `mask`: projector of the directions (φ, p) that LiDAR sees.
StateEvidence swept_evidence(const CondensedCost& cost, std::span<const Correspondence> correspondences,
                             const Pose& condensed_at, const NavState& deskewed, const Deskewing& deskewing,
                             const NavState& state, const Matrix6& mask);

}  // namespace lodestone
