#pragma once

#include <optional>

#include "core/lidar/map_error.h"

namespace lodestone {

/// Rows: products within cubes, within cells, and of cells at up to 15, 30, 60 m and beyond.
inline constexpr int kMapErrorMoments = 6;

/// Displacements measured by two scans from different places: products of the offsets of places in one scan with those
/// in the other. Noise of points and of single planes differs between the scans; the rest repeats. In expectation
/// products = gains · variances. Source: docs/design/042.
struct MapErrorMoments {
  Eigen::Matrix<double, kMapErrorMoments, 1> products_m2 = Eigen::Matrix<double, kMapErrorMoments, 1>::Zero();
  Eigen::Matrix<double, kMapErrorMoments, kMapErrorParts> gains =
      Eigen::Matrix<double, kMapErrorMoments, kMapErrorParts>::Zero();

  /// Variance of each product, up to a common factor.
  Eigen::Matrix<double, kMapErrorMoments, 1> scatter = Eigen::Matrix<double, kMapErrorMoments, 1>::Zero();

  /// Running mean: moves by the given share towards `other`.
  void approach(const MapErrorMoments& other, double share);

  /// The variances that fit best, none below zero; zero for a part that the moments do not show.
  MapErrorVariances variances_m2() const;

  /// The variance if all displacements were those of cubes; not below zero.
  double cube_variance_m2() const;
};

/// Effective number of independent values (Satterthwaite 1946) in the mean square of a scan's offsets, given the smooth
/// parts: a variance from few values is uncertain. 0: no smooth part.
double degrees_of_freedom(const MapError& error, const MapErrorVariances& variances_m2);

/// Empty if the scans have too few cubes in common.
std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b);

}  // namespace lodestone
