#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

using MapErrorCube = std::array<int, 3>;
using Matrix6x3 = Eigen::Matrix<double, 6, 3>;

/// Errors of a cloud map are not white: points near each other were surveyed together and are displaced together. A
/// map's displacement is a sum of independent parts. In the first part, all points of a cube share a vector of three
/// independent components. The others are smooth: two places at distance r have the correlation exp(-r²/2ℓ²).
/// MapErrorMoments infers from the log which parts a map has. Source: docs/design/042.
inline constexpr int kMapErrorParts = 4;

/// Edge of a cube of the first part, m. Source: docs/design/042, which names the drives used to choose the value.
inline constexpr double kMapErrorCube_m = 5.0;

/// Length over which a part changes, m: the edge of a cube, and ℓ = 10, 20 and 40 m.
inline constexpr double map_error_length_m(int part) {
  return kMapErrorCube_m * static_cast<double>(1 << part);
}

/// The cube that contains a place in the map, m. Faces avoid round coordinates, where floors and walls often are: noise
/// would divide the planes of such a wall between two cubes.
MapErrorCube map_error_cube(const Vector3& place);

/// The cell, of eight cubes, that contains the cube.
MapErrorCube cell_of(const MapErrorCube& cube);

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

/// The pose's error due to displacements that change over tens of metres.
struct LongMapError {
  Matrix6 covariance = Matrix6::Zero();  ///< order φ (map axes), p
  double length_m = kMapErrorCube_m;     ///< length of the way over which the error changes
};

/// Effect of the map's error on one scan.
struct MapError {
  /// Covariance of the pose estimated from the scan alone, for a variance of one square metre of the first part. Order
  /// φ (map axes), p.
  Matrix6 cube_covariance = Matrix6::Zero();

  /// In order of their keys; empty if there are too few.
  std::vector<PlaceOffset> cubes;
  std::vector<PlaceOffset> cells;

  Vector3 position = Vector3::Zero();  ///< of the IMU in the map

  /// Inverse of the scan's information about the pose.
  Matrix6 inverse = Matrix6::Zero();

  /// Error due to the smooth parts: the pose estimated from the scan alone, minus the place in the displaced map. With
  /// ℓ = 20 m and more, the place moves by the displacement, and its axes rotate by half the curl.
  LongMapError long_error(const MapErrorVariances& variances_m2) const;
};

/// L of a pose's covariance L Lᵀ. Invertible: sigmas of at least a micrometre and a microradian.
Matrix6 pose_error_root(const Matrix6& covariance);

/// Effect of the map's error on a scan. `T_map_imu`: near the pose that fits the correspondences.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_imu);

}  // namespace lodestone
