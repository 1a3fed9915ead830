#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

using Matrix6x3 = Eigen::Matrix<double, 6, 3>;

/// Edge of a cube, m. Source: docs/design/042, which names the drives that it was chosen with.
inline constexpr double kMapErrorCube_m = 5.0;

/// What a scan says of the displacement of one cube of the map.
struct CubeOffset {
  std::array<int, 3> cube{};
  Vector3 offset_m = Vector3::Zero();      ///< on average `gain` times the cube's displacement
  Matrix3 gain = Matrix3::Zero();          ///< near the identity in directions that many points see
  Matrix6x3 coupling = Matrix6x3::Zero();  ///< of the pose with the displacement: Σ w J nᵀ
  Matrix6x3 by_pose = Matrix6x3::Zero();   ///< transposed: the offset by the pose
};

/// Errors of a cloud map are not white: what stands near each other was surveyed together and is displaced together.
/// Points of a cube of the map share one displacement, three independent components of one variance. A scan then knows
/// its pose no better than its cubes allow, however many points it has.
struct MapError {
  /// Covariance of the pose that is found from the scan alone, for a variance of the cubes of one square metre. Order φ
  /// (map axes), p.
  Matrix6 pose_covariance = Matrix6::Zero();

  /// The cubes, in order of their numbers; empty where there are too few.
  std::vector<CubeOffset> cubes;

  /// Inverse of the scan's information of the pose.
  Matrix6 inverse = Matrix6::Zero();

  /// L of the pose's covariance L Lᵀ for a variance of the cubes, m². Invertible: at least a micrometre and a
  /// microradian.
  Matrix6 pose_error_root_of(double variance_m2) const;
};

/// What the map's error makes of a scan. `T_map_seen`: the pose that fits the correspondences.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen);

/// Two scans from different places, compared: the sum of products of what both say of the same cube. Noise of points
/// and of single planes is another in each; what is left repeats. On average product = gain · variance of the cubes.
struct MapErrorMoments {
  double product_m2 = 0.0;
  double gain = 0.0;

  /// Never below zero.
  double variance_m2() const;
};

/// Nothing where the scans have too few cubes in common.
std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b);

}  // namespace lodestone
