#pragma once

#include <string>

#include "core/geometry/trajectory.h"

namespace lodestone {

/// "x y z qx qy qz qw" (metres, T_map_imu; blanks or commas between). Throws InputError where the text is something
/// else or the quaternion is far from unit length.
Pose parse_initial_pose(const std::string& text);

/// The pose of `trajectory` at `time`: interpolated; its first one where it begins less than 1 s later. `path` is named
/// in messages. Throws InputError where the trajectory does not cover that time.
Pose initial_pose_from(const Trajectory& trajectory, const std::string& path, Time time);

}  // namespace lodestone
