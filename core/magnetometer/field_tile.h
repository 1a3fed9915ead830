#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "core/magnetometer/field_grid.h"

namespace lodestone {

/// A square of the grid's cells with all nodes that interpolation in these cells requires: their nodes, one more ring
/// of nodes below and above, and ghosts. Ghosts are nodes without field that touch the field. They have a linear
/// extrapolation, for the outer nodes of a bicubic patch, and σ = NaN, so that their cells have no field. The values of
/// a tile do not depend on the division into tiles.
class FieldTile {
 public:
  static constexpr int cells = 64;  ///< per side
  static constexpr int stride =
      cells + 3;  ///< nodes per side: one before the first cell's, two after the last cell's first

  /// The tile whose lowest cell is (row, column) of `layer`; null if none of its nodes has field.
  static std::unique_ptr<const FieldTile> make(const FieldGrid& grid, const FieldNodes& nodes, int layer, int row,
                                               int column);

  /// The node at (row, column) from the tile's lowest node, −1 to cells + 1; rows lie `stride` apart.
  const Eigen::Vector4f* node(int row, int column) const {
    return &nodes_[static_cast<std::size_t>(row + 1) * stride + static_cast<std::size_t>(column + 1)];
  }

  static constexpr std::size_t bytes() { return sizeof(Eigen::Vector4f) * stride * stride; }

 private:
  std::vector<Eigen::Vector4f> nodes_;
};

}  // namespace lodestone
