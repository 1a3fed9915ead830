#pragma once

#include <span>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/plane_map_source.h"

namespace lodestone {

/// A pose at which a scan is registered to the map's planes.
struct RegisteredScan {
  Pose T_map_imu;
  Matrix6 information = Matrix6::Zero();  ///< of LiDAR alone, tangent order φ, p
};

/// Distance from which register_scan converges.
inline constexpr double kConverges_m = 0.3;

/// Registers a scan to the planes from a pose with an error up to about kConverges_m and 2°, from near points to far
/// ones, by Gauss-Newton on the condensed cost. The pose does not move along directions that LiDAR does not observe.
/// `points`: imu frame.
RegisteredScan register_scan(std::span<const Eigen::Vector3f> points, const Pose& start, const PlaneMap& map,
                             const ScanLidars& lidars, const AssociationOptions& options);

/// Agreement of a scan with the map.
struct ScanAgreement {
  double cost = 0.0;          ///< mean over points of min(r²/2σ², `most`), `most` for a point without plane
  double clutter_cost = 0.0;  ///< the same, but a point in a voxel with points and no plane costs ln(voxel/√(2π)σ),
                              ///< what a uniform distribution does
  double share = 0.0;         ///< of points within 2.4 σ of their plane
  int points = 0;
  static constexpr double most = 3.0;
};

/// `points`: imu frame. σ is 5 cm plus 3 mm per metre of range: the accuracy of a place before an estimator has refined
/// it.
ScanAgreement agreement(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, const PlaneMap& map);

inline constexpr double kUnmappedShare = 0.05;  ///< as kStaleShare of the magnetic map

/// A scan counts as at most this number of independent points, since neighbours lie on the same surface
/// (docs/design/024-initial-pose-search.md).
inline constexpr double kIndependentPoints = 60.0;

/// ln p(scan | pose) up to a constant, of `points` points with a mean cost. With probability kUnmappedShare the scan
/// sees only what is not on the map, such as people in an open hall; this limits the evidence of few such points.
double scan_log_likelihood(std::size_t points, double cost);

/// The same for a scan off the map, where two thirds of the points fit by chance.
double scan_log_likelihood_off_map(std::size_t points);

/// The number of independent points that `points` are worth: few points provide little evidence.
double independent_points(std::size_t points);

}  // namespace lodestone
