#pragma once

#include <span>
#include <vector>

#include "core/lidar/cube_sums.h"

namespace lodestone {

/// Errors of a cloud map are not white: points near each other were surveyed together and are displaced together. A
/// map's displacement is a sum of independent parts. In the first part, all points of a cube share a vector of three
/// independent components. The others are smooth: two places at distance r have the correlation exp(-r²/2ℓ²).
/// MapErrorMoments infers from the log which parts a map has. Source: docs/design/042.
inline constexpr int kMapErrorParts = 4;

/// Length over which a part changes, m: the edge of a cube, and ℓ = 10, 20 and 40 m.
inline constexpr double map_error_length_m(int part) {
  return kMapErrorCube_m * static_cast<double>(1 << part);
}

/// exp(-r²/2ℓ²) for a smooth part, 1 to 3.
double map_error_correlation(double squared_distance_m2, int part);

/// Variance of a component of the displacement in each part, m².
using MapErrorVariances = Eigen::Matrix<double, kMapErrorParts, 1>;

/// The displacement of one cube or cell, measured by one scan.
struct PlaceOffset {
  MapErrorCube key{};
  Vector3 center = Vector3::Zero();    ///< centroid of the scan's points there, map frame
  Vector3 offset_m = Vector3::Zero();  ///< expectation: the sum over its cubes of gain times displacement
  Matrix3 gain = Matrix3::Zero();      ///< near the identity for a cube with many points on planes of all directions
  Matrix6x3 coupling = Matrix6x3::Zero();  ///< of the pose with the displacement: Σ w J nᵀ
  Matrix6x3 by_pose = Matrix6x3::Zero();   ///< transposed derivative of the offset with respect to the pose
};

/// Displacements of the map as one scan shows them.
struct MapError {
  /// In order of their keys; empty if there are too few.
  std::vector<PlaceOffset> cubes;
  std::vector<PlaceOffset> cells;

  Vector3 position = Vector3::Zero();  ///< of the IMU in the map

  /// Inverse of the scan's information about the pose.
  Matrix6 inverse = Matrix6::Zero();
};

/// What a scan shows of the map's displacement. `T_map_imu`: near the pose that fits the correspondences.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_imu);

}  // namespace lodestone
