#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/lidar/map_error.h"

namespace lodestone {

/// The pose's error due to displacements that change over tens of metres.
struct LongMapError {
  Matrix6 covariance = Matrix6::Zero();  ///< order φ (map axes), p
  double length_m = kMapErrorCube_m;     ///< length of the way over which the error changes
};

/// The error by all parts: independent of each other, zero for a part that a map does not have.
LongMapError sum_of_parts(const std::array<Matrix6, kMapErrorParts>& covariances);

/// L of a pose's covariance L Lᵀ. Invertible: sigmas of at least a micrometre and a microradian.
Matrix6 pose_error_root(const Matrix6& covariance);

/// Sigma of a position, along a direction that a scan does not observe, with which the fit begins. A place that is
/// known worse must not be fitted.
inline constexpr double kUnknownPlace_m = 1.0;

/// What a scan tells of the pose in a map that is displaced.
struct BentMapFit {
  /// The scan's points, displaced as the map is, and such that their least squares, seen through `seen_share`, gives
  /// the best pose.
  std::vector<Correspondence> straightened;

  /// P: the least squares sees the share P of a motion. Order φ (IMU axes), p; as in CondensedCost::seen_share.
  Matrix6 seen_share = Matrix6::Identity();

  /// Covariance of the best pose by displacements of cubes of a variance of one square metre. Order φ (map axes), p.
  Matrix6 cube_covariance = Matrix6::Zero();

  /// By the smooth parts, as far as the scan does not show them: the best pose minus the place in the displaced map.
  /// With ℓ = 20 m and more, the place moves by the displacement, and its axes rotate by half the curl.
  LongMapError long_error;
};

/// Estimates the pose by generalized least squares: together with the map's displacement around the robot, whose parts
/// have `variances_m2`. What is near, and what is displaced as the place is, counts more than what is far away.
/// `T_map_imu`: near the pose, to kUnknownPlace_m. Source: docs/design/069-bent-maps.md.
BentMapFit fit_in_bent_map(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                           const MapErrorVariances& variances_m2);

}  // namespace lodestone
