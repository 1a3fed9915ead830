#include "core/magnetometer/field_tile.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lodestone {
namespace {

constexpr float missing_value = std::numeric_limits<float>::quiet_NaN();

/// Ring of nodes around the tile that ghosts are computed from.
constexpr int reach = 3;
constexpr int side = FieldTile::cells + 2 * reach + 1;

/// The nodes of a tile and a ring of `reach` nodes; NaN beyond the grid.
class Surroundings {
 public:
  Surroundings(const FieldGrid& grid, const FieldNodes& nodes, int layer, int row, int column)
      : nodes_(static_cast<std::size_t>(side) * side, Eigen::Vector4f::Constant(missing_value)) {
    const int first_row = std::max(row - reach, 0);
    const int first_column = std::max(column - reach, 0);
    const int rows = std::min(row - reach + side, grid.rows) - first_row;
    const int columns = std::min(column - reach + side, grid.columns) - first_column;
    std::vector<Eigen::Vector4f> read(static_cast<std::size_t>(rows) * columns);
    if (!nodes.read(layer, first_row, first_column, rows, columns, read.data())) return;
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        const Eigen::Vector4f& node = read[static_cast<std::size_t>(i) * columns + j];
        if (node.allFinite()) nodes_[index(first_row - row + i, first_column - column + j)] = node;
      }
    }
  }

  /// Counted from the tile's lowest node; null without field.
  const Eigen::Vector4f* at(int row, int column) const {
    const Eigen::Vector4f& node = nodes_[index(row, column)];
    return std::isfinite(node[3]) ? &node : nullptr;
  }

 private:
  static std::size_t index(int row, int column) {
    return static_cast<std::size_t>(row + reach) * side + static_cast<std::size_t>(column + reach);
  }
  std::vector<Eigen::Vector4f> nodes_;
};

/// Two sets of four directions: along the axes, otherwise along the diagonals. A ghost's value depends on the node
/// alone and not on the cell of the query, which keeps bicubic patches C¹ along the edge of the field.
Eigen::Vector4f ghost(const Surroundings& around, int row, int column) {
  constexpr int directions[2][4][2] = {{{0, 1}, {0, -1}, {1, 0}, {-1, 0}}, {{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
  for (const auto& round : directions) {
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    int count = 0;
    for (const auto& step : round) {
      const Eigen::Vector4f* near = around.at(row + step[0], column + step[1]);
      const Eigen::Vector4f* far = around.at(row + 2 * step[0], column + 2 * step[1]);
      if (!near || !far) continue;
      sum += 2.0F * *near - *far;
      ++count;
    }
    if (count == 0) continue;
    Eigen::Vector4f value = sum / static_cast<float>(count);
    value[3] = missing_value;
    return value;
  }
  return Eigen::Vector4f::Constant(missing_value);
}

}  // namespace

std::unique_ptr<const FieldTile> FieldTile::make(const FieldGrid& grid, const FieldNodes& nodes, int layer, int row,
                                                 int column) {
  const Surroundings around(grid, nodes, layer, row, column);
  bool any = false;
  for (int i = 0; i <= cells && !any; ++i) {
    for (int j = 0; j <= cells && !any; ++j) any = around.at(i, j) != nullptr;
  }
  if (!any) return nullptr;
  auto tile = std::make_unique<FieldTile>();
  tile->nodes_.reserve(static_cast<std::size_t>(stride) * stride);
  for (int i = -1; i < stride - 1; ++i) {
    for (int j = -1; j < stride - 1; ++j) {
      const Eigen::Vector4f* node = around.at(i, j);
      tile->nodes_.push_back(node != nullptr ? *node : ghost(around, i, j));
    }
  }
  return tile;
}

}  // namespace lodestone
