#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "core/options.h"

namespace lodestone {

enum class FieldInterpolation { bilinear, bicubic };

constexpr auto enum_names(FieldInterpolation) {
  return EnumNames<FieldInterpolation, 2>{
      {{FieldInterpolation::bilinear, "bilinear"}, {FieldInterpolation::bicubic, "bicubic"}}};
}

/// The field at one point of the map frame.
struct FieldValue {
  Vector3 field_ut = Vector3::Zero();      ///< µT, map axes
  Matrix3 gradient = Matrix3::Zero();      ///< ∂B_i/∂x_j, µT/m; the exact derivative of the interpolation used
  double sigma_ut = 0.0;                   ///< posterior one sigma a component, µT
};

/// Layout of the grid. Node (column i, row j) lies at origin + resolution * (i, j): nodes, not cell corners.
struct FieldGrid {
  double resolution_m = 0.1;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< map x, y of node (0, 0)
  int columns = 0;                                   ///< along x
  int rows = 0;                                      ///< along y
  std::vector<double> heights_m;                     ///< map z of each layer, increasing; at least one
};

/// The ambient magnetic field on a regular grid, one or several layers, with posterior sigma at each node.
/// Immutable; queries are thread-safe.
class MagneticMap {
 public:
  /// `nodes`: layer-major, then row, then column; (B_x, B_y, B_z, σ) in µT. NaN marks a node without field.
  /// `max_sigma_ut`: where σ exceeds it there is no field. Throws std::invalid_argument when sizes disagree.
  MagneticMap(FieldGrid grid, std::vector<Eigen::Vector4f> nodes, double max_sigma_ut);

  /// The field at `position` (map, metres); nothing outside the grid, next to a node without field, or where σ is
  /// above the limit. Never extrapolates across x, y; below the lowest and above the highest layer the nearest layer
  /// holds.
  std::optional<FieldValue> query(const Vector3& position, FieldInterpolation interpolation) const;

  const FieldGrid& grid() const { return grid_; }
  const std::vector<Eigen::Vector4f>& nodes() const { return nodes_; }
  double max_sigma_ut() const { return max_sigma_ut_; }

 private:
  FieldGrid grid_;
  std::vector<Eigen::Vector4f> nodes_;
  double max_sigma_ut_;
};

}  // namespace lodestone
