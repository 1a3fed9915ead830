#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

/// Errors of a cloud map are not white: what stands near each other was surveyed together and is displaced together.
/// Points of a cube of the map share one displacement, three independent components of one sigma. A scan then knows its
/// pose no better than its cubes allow, however many points it has.
struct MapError {
  /// Covariance of the pose that is found from the scan alone, for a sigma of the cubes of one metre. Order φ (map
  /// axes), p.
  Matrix6 pose_covariance = Matrix6::Zero();

  /// The cubes' variance as this scan's residuals show it, m²; by chance also below zero.
  double variance_m2 = 0.0;

  /// How much this scan says of it: 0 if there are too few cubes.
  bool known = false;

  /// L of the pose's covariance L Lᵀ for a sigma of the cubes, m. Invertible: at least a micrometre and a microradian.
  Matrix6 pose_error_root_of(double sigma_m) const;
};

/// Edge of a cube, m. Source: docs/design/042, a study over worlds that no acceptance table uses.
inline constexpr double kMapErrorCube_m = 5.0;

/// What the map's error makes of a scan. `T_map_seen`: the pose that fits the correspondences. The variance is found by
/// the method of moments: squares of the cubes' mean residuals, less what noise of points makes of them, over what one
/// square metre would make of them; what the fitted pose takes up is accounted for.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen);

}  // namespace lodestone
