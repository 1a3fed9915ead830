#pragma once

#include "core/geometry/pose.h"
#include "core/lidar/swept_cost.h"

namespace lodestone {

/// Moves the swept costs of a scan rigidly: if both states agree with the motion of deskewing, they are least at the
/// pose at which `scan.cost` is least. Swept costs weigh points differently, because errors of the map look like motion
/// within the scan. Without this, a scan whose points were displaced such that their least squares give the best pose
/// in a bent map (BentMapFit) would have another one in the window. `T_map_imu`: the pose of accumulation. Directions
/// that are known worse than kUnknownPlace_m and kUnknownTurn_rad are moved less.
/// Source: docs/design/069-bent-maps.md.
void keep_least_pose(CondensedScan& scan, const Pose& T_map_imu);

}  // namespace lodestone
