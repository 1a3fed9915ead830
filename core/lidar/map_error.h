#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

using Matrix6x3 = Eigen::Matrix<double, 6, 3>;

/// Errors of a cloud map are not white: what stands near each other was surveyed together and is displaced together.
/// The displacement of a place is the sum of one vector for each scale: all points of a cube of the map share the
/// vector of that cube, three independent components. Cubes of 5, 10, 20 and 40 m, one in the other. Which scales a map
/// has, the log shows (MapErrorMoments). Source: docs/design/042.
inline constexpr int kMapErrorScales = 4;

/// Edge of a cube of the finest scale, m. Source: docs/design/042, which names the drives that it was chosen with.
inline constexpr double kMapErrorCube_m = 5.0;

/// Edge of a cube of each scale, m.
inline constexpr double map_error_cube_m(int scale) {
  return kMapErrorCube_m * static_cast<double>(1 << scale);
}

using MapErrorCube = std::array<int, 3>;

/// The cube of a scale that holds a place in the map, m. No face has a round coordinate, as floors and walls have: the
/// planes of a surface in a face would be parted by their noise, those that err upwards from those that err downwards.
MapErrorCube map_error_cube(const Vector3& place, int scale);

/// Variance of a component of the displacement at each scale, m².
using MapErrorVariances = Eigen::Matrix<double, kMapErrorScales, 1>;

/// What a scan says of the displacement of one cube of the finest scale.
struct CubeOffset {
  MapErrorCube cube{};
  Vector3 offset_m = Vector3::Zero();      ///< on average `gain` times the cube's displacement
  Matrix3 gain = Matrix3::Zero();          ///< near the identity in directions that many points see
  Matrix6x3 coupling = Matrix6x3::Zero();  ///< of the pose with the displacement: Σ w J nᵀ
  Matrix6x3 by_pose = Matrix6x3::Zero();   ///< transposed: the offset by the pose
};

/// What the map's error makes of one scan.
struct MapError {
  /// Covariance of the pose that is found from the scan alone against the place in the map, for a variance of one
  /// square metre at each scale. Order φ (map axes), p. The place is displaced as what surrounds it, on the scales
  /// of 20 m and more: the robot's own cube makes no error where a scale is long against the scan.
  std::array<Matrix6, kMapErrorScales> pose_covariance;

  /// The same against a place that is not displaced.
  std::array<Matrix6, kMapErrorScales> fit_covariance;

  /// The cubes, in order of their numbers; empty where there are too few.
  std::vector<CubeOffset> cubes;

  /// Inverse of the scan's information of the pose.
  Matrix6 inverse = Matrix6::Zero();

  MapError();

  /// Covariance of the pose for such displacements.
  Matrix6 pose_covariance_of(const MapErrorVariances& variances_m2) const;

  /// The way over which the pose's error changes, m: the scales' edges, each by its share of the position's variance.
  double length_m_of(const MapErrorVariances& variances_m2) const;
};

/// L of a pose's covariance L Lᵀ. Invertible: at least a micrometre and a microradian.
Matrix6 pose_error_root(const Matrix6& covariance);

/// What the map's error makes of a scan. `T_map_seen`: near the pose that fits the correspondences.
MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen);

/// Two scans from different places, compared: the products of what both say of cubes that lie in one cube of a scale.
/// Noise of points and of single planes is another in each; what is left repeats. On average products = gains ·
/// variances.
struct MapErrorMoments {
  MapErrorVariances products_m2 = MapErrorVariances::Zero();
  Eigen::Matrix<double, kMapErrorScales, kMapErrorScales> gains =
      Eigen::Matrix<double, kMapErrorScales, kMapErrorScales>::Zero();

  /// The variances that fit best, none below zero; a scale that the moments do not show has none.
  MapErrorVariances variances_m2() const;

  /// The variance if all were displaced on the finest scale; not below zero.
  double finest_variance_m2() const;
};

/// Nothing where the scans have too few cubes in common.
std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b);

}  // namespace lodestone
