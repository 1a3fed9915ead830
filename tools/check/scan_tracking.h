#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/lidar/plane_map.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Uncertainty of a predicted pose, one sigma per axis.
struct PredictionSigmas {
  double sigma_rad;
  double sigma_m;
};

/// A scan registered to the planes of earlier scans.
struct TrackedScan {
  Pose pose;
  bool is_degenerate = false;  ///< a direction of translation keeps its prediction
};

/// Registers a scan to the planes of earlier scans: Gauss-Newton on the condensed cost, with the prediction as prior.
/// Planes fitted to few points have wrong normals, and thousands of them add spurious information along a tunnel. A
/// direction with less than 1 % of the information of the best one therefore keeps its prediction. `points`: lidar
/// frame, deskewed to one time.
TrackedScan track_scan(std::span<const Eigen::Vector3f> points, const Pose& predicted, const PredictionSigmas& sigmas,
                       const PlaneMap& map, const LidarModel& lidar);

}  // namespace lodestone
