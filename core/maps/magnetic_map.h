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
  /// `max_sigma_ut`: where σ exceeds it there is no field. Throws std::invalid_argument when sizes disagree, a side has
  /// fewer than two nodes, or heights do not increase.
  MagneticMap(FieldGrid grid, const std::vector<Eigen::Vector4f>& nodes, double max_sigma_ut);

  /// The field at `position` (map, metres); nothing outside the grid, in a cell with a corner without field, or where
  /// σ is above the limit. Never extrapolates across x, y; below the lowest and above the highest layer the nearest
  /// layer holds. Between layers the field is linear in z. σ is bilinear for both interpolations. `bicubic` is cubic
  /// convolution (Keys 1981, a = −1/2: Catmull-Rom), C¹ wherever there is field.
  std::optional<FieldValue> query(const Vector3& position, FieldInterpolation interpolation) const;

  const FieldGrid& grid() const { return grid_; }

  /// One node (B_x, B_y, B_z, σ); all NaN where there is no field.
  Eigen::Vector4f node(int layer, int row, int column) const;

  /// All nodes in the constructor's order. Builds the array: take it once, not in a loop.
  std::vector<Eigen::Vector4f> nodes() const;

  double max_sigma_ut() const { return max_sigma_ut_; }

 private:
  std::size_t padded_index(int layer, int row, int column) const {
    return (static_cast<std::size_t>(layer) * (grid_.rows + 2) + row + 1) * (grid_.columns + 2) + column + 1;
  }
  void fill_ghosts(int layer);

  FieldGrid grid_;
  double max_sigma_ut_;
  /// The grid with a ring of one node around it. Nodes without field that touch the field are ghosts: they hold a
  /// linear extrapolation for the outer nodes of a bicubic patch, and σ = NaN, so that no cell at them is answered.
  std::vector<Eigen::Vector4f> padded_;
};

}  // namespace lodestone
