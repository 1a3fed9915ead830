#pragma once

#include "core/lidar/condensed_cost.h"
#include "core/observability/degeneracy.h"

namespace lodestone {

/// Degeneracy by the predicted sigmas of one scan alone, without the spurious information of its normals
/// (docs/design/005-errors-of-normals.md). `T_map_imu`: the pose of accumulation. Without correspondences, no direction
/// has information.
Degeneracy analyse_scan(const CondensedCost& cost, const Pose& T_map_imu, const DegeneracyOptions& options);

/// Number of directions that are known worse than 0.1 m, by the analysis of one scan alone. Unlike the rules of the
/// estimators, it does not ask where LiDAR is accurate, but where it holds the robot at all
/// (docs/design/050-health.md).
int unobserved_directions(const Degeneracy& by_scan);

}  // namespace lodestone
