#pragma once

#include <string>

#include "core/geometry/trajectory.h"

namespace lodestone {

/// Parses "x y z qx qy qz qw" (metres, T_map_imu; separated by blanks or commas). `origin_m` is subtracted. Throws
/// InputError if the text has another form or the quaternion is far from unit length.
Pose parse_initial_pose(const std::string& text, const Vector3& origin_m = Vector3::Zero());

/// The pose of `trajectory` at `time`, interpolated. If the trajectory begins less than 1 s later, its first pose.
/// `path` is named in messages. Throws InputError if the trajectory does not cover that time.
Pose initial_pose_from(const Trajectory& trajectory, const std::string& path, Time time);

/// The velocity at that time, map axes, m/s: mean over at most 0.5 s about it. Zero if the trajectory covers less than
/// 0.1 s of these.
Vector3 initial_velocity_from(const Trajectory& trajectory, Time time);

}  // namespace lodestone
