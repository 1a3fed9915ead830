#pragma once

#include <span>

#include "core/imu/deskewing.h"
#include "core/lidar/condensed_cost.h"
#include "estimators/ieskf/iterated_update.h"

namespace lodestone {

/// Information of a scan about the pose, with points as they are. `mask`: as below.
PoseEvidence masked_evidence(const CondensedCost& cost, const Pose& T_map_imu, const Matrix6& mask);

/// Information of a deskewed scan about the state at its end. Errors of velocity, biases and gravity displace a point
/// of age t by t δv, t δb_g and t²/2 δa. The IMU's noise within the step is marginalized. `cost`: condensed from
/// `correspondences` at `condensed_at`. `deskewed`: the state of `deskewing`. `mask`: projector onto the directions (φ,
/// p) that LiDAR observes. Source: docs/design/008-swept-scan-factor.md.
StateEvidence swept_evidence(const CondensedCost& cost, std::span<const Correspondence> correspondences,
                             const Pose& condensed_at, const NavState& deskewed, const Deskewing& deskewing,
                             const NavState& state, const Matrix6& mask);

}  // namespace lodestone
