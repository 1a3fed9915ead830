#pragma once

#include "core/geometry/trajectory.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Compares the accelerometer with the path driven: a bias above the estimator's expectation, and a step of the bias.
/// `poses`: T_map_imu at scan ends. The second difference of positions half a second apart is that of the twice
/// integrated specific force and gravity. The remainder is the bias.
Findings check_acceleration_along(const Trajectory& poses, const LogSample& sample, const Platform& platform);

/// Checks the heading of T_imu_lidar, which yaw turns alone do not show: compares the directions of the accelerations
/// of IMU and LiDAR. No finding if the robot accelerates too little. `lidar_poses`: of follow_scans. `lidar`: the index
/// of that LiDAR.
Findings check_heading(const Trajectory& lidar_poses, const LogSample& sample, const Platform& platform,
                       std::size_t lidar = 0);

}  // namespace lodestone
