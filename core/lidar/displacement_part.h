#pragma once

#include <cstddef>
#include <vector>

#include "core/lidar/map_error.h"

namespace lodestone {

/// The finer parts contain errors of planes, of sensors and of moved objects; these do not displace the place.
inline constexpr int kFirstPartOfPlaces = 2;

/// Scans with more cubes use pairs of cells: a twentieth of the pairs. Far away, cells resolve as finely as cubes in a
/// room.
inline constexpr std::size_t kManyCubes = 150;

/// An axis along which a scan measures the displacement of a region of the map.
struct DisplacedAxis {
  std::size_t region;
  Vector3 place;
  Vector3 axis;
};

/// A cube or cell of the map, and how its displacement moves the pose.
struct DisplacedPlace {
  Vector3 center = Vector3::Zero();
  Matrix6x3 moved = Matrix6x3::Zero();
  Matrix6 apart = Matrix6::Zero();  ///< the pose's covariance by independent displacements of its cubes
  double spread_m2 = 0.0;           ///< mean square of distances from the center
  double weights = 0.0;
};

/// One part of the map's displacement, relative to that of the robot's place S: with ℓ = 20 m and more, the place
/// moves by the displacement there, and turns by half its curl. All variances are for a part of one square metre.
/// Source: docs/design/042-repeated-map-error.md.
class DisplacementPart {
 public:
  DisplacementPart(int part, const Vector3& position);

  int part() const { return part_; }

  double variance(const DisplacedAxis& axis) const;

  /// Of the displacements along the axes.
  Eigen::MatrixXd covariance(const std::vector<DisplacedAxis>& axes) const;

  /// Of the pose. Order φ (map axes), p.
  Matrix6 covariance_of_pose(const std::vector<DisplacedPlace>& places) const;

  /// Share of the variance by which places differ from the mean of places whose mean squared distance from their center
  /// is `spread_m2`: squared distances of pairs are twice that.
  double share_apart(double spread_m2) const { return 1.0 - map_error_correlation(2.0 * spread_m2, part_); }

 private:
  /// Tᵀ a for the motion T S of a place, and (Var(S) / 2 - Cov(S, d)) along the axis.
  struct Motion {
    Vector6 moved;
    Vector6 rest;
  };
  Motion motion(const DisplacedAxis& axis) const;

  int part_;
  Vector3 position_;
  Vector6 place_ = Vector6::Zero();  // Var(S)
};

}  // namespace lodestone
