#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

using MapErrorCube = std::array<int, 3>;
using Matrix6x3 = Eigen::Matrix<double, 6, 3>;

/// Edge of a cube of the map, m. Source: docs/design/042, which names the drives used to choose the value.
inline constexpr double kMapErrorCube_m = 5.0;

/// The cube that contains a place in the map, m. Faces avoid round coordinates, where floors and walls often are: noise
/// would divide the planes of such a wall between two cubes.
MapErrorCube map_error_cube(const Vector3& place);

/// The cell, of eight cubes, that contains the cube.
MapErrorCube cell_of(const MapErrorCube& cube);

/// Sums over the correspondences of a cube of the map, with w the inverse variance, r the residual, n the normal,
/// J = [a × n; n], a the point from the IMU in map axes, and e the error of n.
struct CubeSums {
  MapErrorCube key{};
  Matrix6x3 coupling = Matrix6x3::Zero();  ///< Σ w J nᵀ
  Matrix6x3 spurious = Matrix6x3::Zero();  ///< Σ w A Cov(e), A = [a ×; 1]
  Matrix3 weight = Matrix3::Zero();        ///< Σ w n nᵀ
  Vector3 residual = Vector3::Zero();      ///< Σ w n r
  Vector3 center = Vector3::Zero();        ///< of the planes, weighted by w
  double weights = 0.0;
};

/// A scan's sums. Order of six: φ (map axes), p.
struct ScanSums {
  std::vector<CubeSums> cubes;            ///< in order of their keys
  std::vector<std::size_t> cube_of;       ///< of each correspondence
  Matrix6 information = Matrix6::Zero();  ///< Σ w J Jᵀ
  Matrix6 spurious = Matrix6::Zero();     ///< Σ w A Cov(e) Aᵀ (docs/design/005)
  Vector6 gradient = Vector6::Zero();     ///< Σ w J r
};

/// `with_spurious`: otherwise the spurious sums are zero, which takes a third of the products.
ScanSums sum_by_cubes(std::span<const Correspondence> correspondences, const Pose& T_map_imu, bool with_spurious);

}  // namespace lodestone
