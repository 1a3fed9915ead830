#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/lidar/plane_map.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// How far a pose may lie from its prediction, one sigma of each axis.
struct PredictionTrust {
  double sigma_rad;
  double sigma_m;
};

/// Moves a scan from where it is predicted onto the planes of the scans before it: Gauss-Newton on the condensed cost,
/// the prediction a prior. Planes fitted to few points of a scan have normals that are off by degrees, and thousands of
/// them together claim to see along a tunnel, to millimetres and wrongly: along a direction of which they know less
/// than 1 % of what they know of the best one, the scan stays where it was predicted. `points`: lidar frame, deskewed
/// to one time.
Pose track_scan(std::span<const Eigen::Vector3f> points, const Pose& predicted, const PredictionTrust& trust,
                const PlaneMap& map, const LidarModel& lidar);

}  // namespace lodestone
