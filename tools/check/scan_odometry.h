#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Motion of a LiDAR, estimated from its scans only.
struct ScanOdometry {
  /// T_start_lidar at each scan's middle (the mean of its points' times): from the lidar frame then to that of the
  /// first scan.
  Trajectory poses;
  std::vector<Eigen::Vector3f> first_scan;  ///< lidar frame, metres
  std::optional<Time> first_degenerate;     ///< the first scan that does not observe each direction of motion
  bool lost = false;                        ///< odometry was lost; the poses end before the last scan
};

/// Registers scan after scan to planes fitted to earlier scans, with constant velocity for deskewing and prediction.
/// Uses only ranges and noise of the platform, no IMU, extrinsics or map, so that these can be checked independently.
/// Drifts; along a degenerate direction, it continues at the last velocity. Empty scans are skipped. After an outage of
/// more than a second, it restarts at the same pose, at rest.
ScanOdometry follow_scans(std::span<const LidarScan> scans, const LidarModel& lidar);

}  // namespace lodestone
