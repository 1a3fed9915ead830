#pragma once

#include <span>
#include <vector>

#include "core/imu/scan_motion.h"
#include "core/measurements.h"

namespace lodestone {

/// Transforms each point from its own time to the scan's end: p_imu(t_k) = T_end_t T_imu_lidar p_lidar(t). Result: imu
/// frame at the scan's end, metres, in the order of `points`. `scan_start` is the time of offset 0.
std::vector<Eigen::Vector3f> deskew(std::span<const LidarPoint> points, Time scan_start, const ScanMotion& motion,
                                    const Pose& T_imu_lidar);

/// Time from each point to `end`, s.
std::vector<float> ages_at(Time end, std::span<const LidarPoint> points, Time scan_start);

}  // namespace lodestone
