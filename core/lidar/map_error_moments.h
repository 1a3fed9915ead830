#pragma once

#include <optional>

#include "core/lidar/map_error.h"

namespace lodestone {

/// Rows: products within cubes, within cells, and of cells at up to 15, 30, 60 m and beyond.
inline constexpr int kMapErrorMoments = 6;

/// What two scans from different places say of displacements: products of the offsets of places in one scan with those
/// in the other. Noise of points and of single planes is another in each; what is left repeats. On average
/// products = gains · variances. Source: docs/design/042.
struct MapErrorMoments {
  Eigen::Matrix<double, kMapErrorMoments, 1> products_m2 = Eigen::Matrix<double, kMapErrorMoments, 1>::Zero();
  Eigen::Matrix<double, kMapErrorMoments, kMapErrorParts> gains =
      Eigen::Matrix<double, kMapErrorMoments, kMapErrorParts>::Zero();

  /// Variance of each product, but for a factor that all share.
  Eigen::Matrix<double, kMapErrorMoments, 1> scatter = Eigen::Matrix<double, kMapErrorMoments, 1>::Zero();

  /// Running mean: a share of the way towards `other`.
  void approach(const MapErrorMoments& other, double share);

  /// The variances that fit best, none below zero; a part that the moments do not show has none.
  MapErrorVariances variances_m2() const;

  /// The variance if all displacements were of cubes; not below zero.
  double cube_variance_m2() const;
};

/// Of how many independent values (Satterthwaite 1946) the mean square of a scan's offsets is, by the smooth parts: a
/// variance from so few of them may as well be larger. 0: there is no smooth part.
double degrees_of_freedom(const MapError& error, const MapErrorVariances& variances_m2);

/// Nothing where the scans have too few cubes in common.
std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b);

}  // namespace lodestone
