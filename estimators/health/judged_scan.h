#pragma once

#include <span>
#include <vector>

#include "core/lidar/plane_map.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"
#include "estimators/estimate.h"

namespace lodestone {

/// The points of a scan by which an estimate is judged, whatever its estimator made of them: those within the
/// LiDAR's range, in the imu frame at the scan's end.
struct JudgedScan {
  Pose T_map_imu;                     ///< where the scan should fit: Estimate::scan_pose, or the state's pose
  std::vector<LidarPoint> measured;   ///< a sample of at most some thousand, as the LiDAR measured them
  std::vector<Eigen::Vector3f> all;   ///< the same, deskewed
  std::vector<Eigen::Vector3f> even;  ///< above the floor, one in each cube of 1 m; empty if there are too few
};

/// `bundle`: with IMU; `estimate`: at its scan's end.
JudgedScan judged_scan(const ScanBundle& bundle, const Estimate& estimate, const SensorSuite& suite);

/// The share of `points` (imu frame) where the map is occupied, from 0 to 1. There must be points.
double share_on_map(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, const PlaneMap& map);

}  // namespace lodestone
