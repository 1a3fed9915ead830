#pragma once

#include <span>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/plane_map_source.h"

namespace lodestone {

/// A pose at which a scan lies on the map's planes.
struct RegisteredScan {
  Pose T_map_imu;
  Matrix6 information = Matrix6::Zero();  ///< of LiDAR alone, order φ, p
};

/// Moves a scan from a place that is right to about 0.3 m and 2° onto the planes, from near points to far ones, by
/// Gauss-Newton on the condensed cost. Directions that LiDAR does not see stay where they were. `points`: imu frame.
RegisteredScan register_scan(std::span<const Eigen::Vector3f> points, const Pose& start, const PlaneMap& map,
                             const ScanLidars& lidars, const AssociationOptions& options);

/// How well a scan lies on the map.
struct ScanAgreement {
  double cost = 0.0;   ///< mean over points of min(r²/2σ², `most`), `most` for a point without plane
  double share = 0.0;  ///< of points within 2.4 σ of their plane
  int points = 0;
  static constexpr double most = 3.0;
};

/// σ is 5 cm and 3 mm a metre of range: what a place is right to before an estimator had a say.
ScanAgreement agreement(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, const PlaneMap& map);

/// A scan says at most as much as so many independent points: neighbours lie on the same surface
/// (docs/design/024-initial-pose-search.md).
inline constexpr double kIndependentPoints = 60.0;

/// How many independent points a scan's `points` are worth: what stands in view may be little, then it says little.
double independent_points(std::size_t points);

}  // namespace lodestone
