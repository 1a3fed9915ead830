#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

/// What a scan says of the displacement of one cube of the map.
struct CubeOffset {
  std::array<int, 3> cube{};
  Vector3 offset_m = Vector3::Zero();  ///< on average `gain` times the cube's displacement
  Matrix3 gain = Matrix3::Zero();      ///< near the identity in directions that many points see
};

/// Errors of a cloud map are not white: what stands near each other was surveyed together and is displaced together.
/// Points of a cube of the map share one displacement, three independent components of one sigma. A scan then knows its
/// pose no better than its cubes allow, however many points it has.
struct MapError {
  /// Covariance of the pose that is found from the scan alone, for a sigma of the cubes of one metre. Order φ (map
  /// axes), p.
  Matrix6 pose_covariance = Matrix6::Zero();

  /// The cubes, in order of their numbers; empty where there are too few.
  std::vector<CubeOffset> cubes;

  /// Share of the cubes' displacements that is left in the offsets once the pose was fitted to them.
  double left_share = 1.0;

  /// L of the pose's covariance L Lᵀ for a sigma of the cubes, m. Invertible: at least a micrometre and a
  /// microradian.
  Matrix6 pose_error_root_of(double sigma_m) const;
};

/// Edge of a cube, m. Source: docs/design/042, which names the drives that it was chosen with.
inline constexpr double kMapErrorCube_m = 5.0;

/// What the map's error makes of a scan. `T_map_seen`: the pose that fits the correspondences.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen);

/// Variance of the cubes' displacements, m², as two scans from different places show it: the mean product of what both
/// say of the same cube. Noise of points and of single planes is another in each; what is left repeats. Nothing where
/// they have too few cubes in common.
std::optional<double> repeated_variance(const MapError& a, const MapError& b);

}  // namespace lodestone
