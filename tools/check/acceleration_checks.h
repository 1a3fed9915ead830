#pragma once

#include "core/geometry/trajectory.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// The accelerometer held against the way that the robot went: a bias beyond what an estimator expects, and a step of
/// it. `poses`: T_map_imu at scan ends. The second difference of positions half a second apart is that of the twice
/// integrated specific force and gravity; what is left is the bias.
Findings check_acceleration_along(const Trajectory& poses, const LogSample& sample, const Platform& platform);

/// Whether T_imu_lidar is right about the vertical, which turning on a floor does not show: the directions in which IMU
/// and LiDAR speed up, held against each other. `lidar_poses`: of follow_scans. Says nothing where too little speeds
/// up. `lidar`: the index of the LiDAR whose poses they are.
Findings check_heading(const Trajectory& lidar_poses, const LogSample& sample, const Platform& platform,
                       std::size_t lidar = 0);

}  // namespace lodestone
