#pragma once

#include <span>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// How the LiDAR moved by its scans alone.
struct ScanOdometry {
  /// T_start_lidar at each scan's middle (the mean of its points' times): the lidar frame then, in that of the first
  /// scan.
  Trajectory poses;
  std::vector<Eigen::Vector3f> first_scan;  ///< lidar frame, metres
  bool lost = false;                        ///< the scans could not be followed to their end: what is here ends before
};

/// Follows scan after scan on planes fitted to those before it, with a constant velocity to deskew and to predict. It
/// uses nothing of the platform but ranges and noise, no IMU, no extrinsics and no map: what these say can be held
/// against it. Drifts; along a direction that the scans do not see (a tunnel's axis) it goes on at its last velocity.
/// Empty scans are passed over; after more than a second without any it starts anew where it was, at rest.
ScanOdometry follow_scans(std::span<const LidarScan> scans, const LidarModel& lidar);

}  // namespace lodestone
