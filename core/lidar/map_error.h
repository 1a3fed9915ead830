#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

using MapErrorCube = std::array<int, 3>;
using Matrix6x3 = Eigen::Matrix<double, 6, 3>;

/// Errors of a cloud map are not white: what stands near each other was surveyed together and is displaced together.
/// A map's displacement is a sum of independent parts. In the first, all points of a cube share a vector of three
/// independent components. The others are smooth: two places at distance r have the correlation exp(-r²/2ℓ²). Which
/// parts a map has, the log shows (MapErrorMoments). Source: docs/design/042.
inline constexpr int kMapErrorParts = 4;

/// Edge of a cube of the first part, m. Source: docs/design/042, which names the drives that it was chosen with.
inline constexpr double kMapErrorCube_m = 5.0;

/// Over which a part changes, m: the edge of a cube, and ℓ = 10, 20 and 40 m.
inline constexpr double map_error_length_m(int part) {
  return kMapErrorCube_m * static_cast<double>(1 << part);
}

/// The cube that holds a place in the map, m. No face has a round coordinate, as floors and walls have: the planes of
/// one wall would be parted by their noise.
MapErrorCube map_error_cube(const Vector3& place);

/// The cell of eight cubes.
MapErrorCube cell_of(const MapErrorCube& cube);

/// exp(-r²/2ℓ²) for a smooth part, 1 to 3.
double map_error_correlation(double squared_distance_m2, int part);

/// Variance of a component of the displacement in each part, m².
using MapErrorVariances = Eigen::Matrix<double, kMapErrorParts, 1>;

/// What a scan says of the displacement of one cube or cell.
struct PlaceOffset {
  MapErrorCube key{};
  Vector3 center = Vector3::Zero();        ///< of what the scan sees there, map
  Vector3 offset_m = Vector3::Zero();      ///< on average the sum of gain and displacement of its cubes
  Matrix3 gain = Matrix3::Zero();          ///< near the identity for a cube that many points see from all sides
  Matrix6x3 coupling = Matrix6x3::Zero();  ///< of the pose with the displacement: Σ w J nᵀ
  Matrix6x3 by_pose = Matrix6x3::Zero();   ///< transposed: the offset by the pose
};

/// The pose's error by displacements that change over tens of metres.
struct LongMapError {
  Matrix6 covariance = Matrix6::Zero();  ///< order φ (map axes), p
  double length_m = kMapErrorCube_m;     ///< of the way over which it changes
};

/// What the map's error makes of one scan.
struct MapError {
  /// Covariance of the pose that is found from the scan alone, for a variance of one square metre of the first part.
  /// Order φ (map axes), p.
  Matrix6 cube_covariance = Matrix6::Zero();

  /// In order of their keys; empty where there are too few.
  std::vector<PlaceOffset> cubes;
  std::vector<PlaceOffset> cells;

  Vector3 position = Vector3::Zero();  ///< of the IMU in the map

  /// Inverse of the scan's information of the pose.
  Matrix6 inverse = Matrix6::Zero();

  /// By the smooth parts: the pose that is found from the scan alone against the place in the displaced map. With
  /// ℓ = 20 m and more the place moves by the displacement, and its axes turn by half the curl.
  LongMapError long_error(const MapErrorVariances& variances_m2) const;
};

/// L of a pose's covariance L Lᵀ. Invertible: at least a micrometre and a microradian.
Matrix6 pose_error_root(const Matrix6& covariance);

/// What the map's error makes of a scan. `T_map_seen`: near the pose that fits the correspondences.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen);

}  // namespace lodestone
