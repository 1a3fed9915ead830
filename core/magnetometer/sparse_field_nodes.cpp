#include "core/magnetometer/sparse_field_nodes.h"

#include <algorithm>
#include <limits>

namespace lodestone {
namespace {

const Eigen::Vector4f missing_node = Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN());

}  // namespace

void SparseFieldNodes::set(int layer, int row, int column, const Eigen::Vector4f& node) {
  std::vector<Eigen::Vector4f>& square = squares_[key(layer, row, column)];
  if (square.empty()) square.assign(static_cast<std::size_t>(side) * side, missing_node);
  square[static_cast<std::size_t>(row % side) * side + static_cast<std::size_t>(column % side)] = node;
}

bool SparseFieldNodes::read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const {
  std::fill_n(nodes, static_cast<std::size_t>(rows) * columns, missing_node);
  bool any = false;
  for (int square_row = row / side; square_row * side < row + rows; ++square_row) {
    for (int square_column = column / side; square_column * side < column + columns; ++square_column) {
      const auto found = squares_.find(key(layer, square_row * side, square_column * side));
      if (found == squares_.end()) continue;
      any = true;
      const int first = std::max(column, square_column * side);
      const int last = std::min(column + columns, (square_column + 1) * side);
      for (int i = std::max(row, square_row * side); i < std::min(row + rows, (square_row + 1) * side); ++i) {
        std::copy_n(found->second.begin() + (i % side) * side + first % side, last - first,
                    nodes + static_cast<std::size_t>(i - row) * columns + (first - column));
      }
    }
  }
  return any;
}

}  // namespace lodestone
