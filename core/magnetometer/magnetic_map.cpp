#include "core/magnetometer/magnetic_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace lodestone {
namespace {

constexpr float missing = std::numeric_limits<float>::quiet_NaN();

/// A coordinate along one axis of the grid: cell index and share of the way to the next node.
struct CellPosition {
  int index = 0;
  double share = 0.0;
};

/// False outside [0, nodes − 1]. The far edge belongs to the last cell; rounding errors at an edge are accepted.
bool locate(double coordinate, int nodes, CellPosition& position) {
  constexpr double rounding = 1e-9;
  const double last = nodes - 1;
  if (!(coordinate >= -rounding && coordinate <= last + rounding)) return false;
  position.index = std::clamp(static_cast<int>(coordinate), 0, nodes - 2);
  position.share = std::clamp(coordinate - position.index, 0.0, 1.0);
  return true;
}

/// Weights of the four nodes around a cell (Keys 1981, a = −1/2) and their derivatives by the share t.
void cubic_weights(double t, std::array<double, 4>& value, std::array<double, 4>& slope) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  value = {0.5 * (-t + 2.0 * t2 - t3), 0.5 * (2.0 - 5.0 * t2 + 3.0 * t3), 0.5 * (t + 4.0 * t2 - 3.0 * t3),
           0.5 * (t3 - t2)};
  slope = {0.5 * (-1.0 + 4.0 * t - 3.0 * t2), 0.5 * (-10.0 * t + 9.0 * t2), 0.5 * (1.0 + 8.0 * t - 9.0 * t2),
           0.5 * (3.0 * t2 - 2.0 * t)};
}

struct LayerValue {
  Eigen::Vector4d value;  ///< field and, in the last entry, σ; the same for the slopes
  Eigen::Vector4d along_x;
  Eigen::Vector4d along_y;
};

constexpr int stride = FieldTile::stride;

/// `corner` points at the cell's node of lowest row and column, in its tile.
void bilinear(const Eigen::Vector4f* corner, double s, double t, LayerValue& result) {
  const Eigen::Vector4d n00 = corner[0].cast<double>();
  const Eigen::Vector4d n01 = corner[1].cast<double>();
  const Eigen::Vector4d n10 = corner[stride].cast<double>();
  const Eigen::Vector4d n11 = corner[stride + 1].cast<double>();
  const Eigen::Vector4d lower = n00 + s * (n01 - n00);
  const Eigen::Vector4d upper = n10 + s * (n11 - n10);
  result.value = lower + t * (upper - lower);
  result.along_x = (1.0 - t) * (n01 - n00) + t * (n11 - n10);
  result.along_y = upper - lower;
}

void bicubic(const Eigen::Vector4f* corner, double s, double t, LayerValue& result) {
  std::array<double, 4> value_x, slope_x, value_y, slope_y;
  cubic_weights(s, value_x, slope_x);
  cubic_weights(t, value_y, slope_y);
  result.value.setZero();
  result.along_x.setZero();
  result.along_y.setZero();
  for (int row = 0; row < 4; ++row) {
    const Eigen::Vector4f* nodes = corner + (row - 1) * stride - 1;
    const Eigen::Vector4d n0 = nodes[0].cast<double>();
    const Eigen::Vector4d n1 = nodes[1].cast<double>();
    const Eigen::Vector4d n2 = nodes[2].cast<double>();
    const Eigen::Vector4d n3 = nodes[3].cast<double>();
    const Eigen::Vector4d value = value_x[0] * n0 + value_x[1] * n1 + value_x[2] * n2 + value_x[3] * n3;
    result.value += value_y[row] * value;
    result.along_x += value_y[row] * (slope_x[0] * n0 + slope_x[1] * n1 + slope_x[2] * n2 + slope_x[3] * n3);
    result.along_y += slope_y[row] * value;
  }
}

double bilinear_sigma(const Eigen::Vector4f* corner, double s, double t) {
  const double lower = corner[0][3] + s * (static_cast<double>(corner[1][3]) - corner[0][3]);
  const double upper = corner[stride][3] + s * (static_cast<double>(corner[stride + 1][3]) - corner[stride][3]);
  return lower + t * (upper - lower);
}

void check_grid(const FieldGrid& grid) {
  if (grid.columns < 2 || grid.rows < 2) throw std::invalid_argument("MagneticMap: a side has fewer than two nodes");
  if (!(grid.resolution_m > 0.0)) throw std::invalid_argument("MagneticMap: the resolution must be positive");
  if (grid.heights_m.empty()) throw std::invalid_argument("MagneticMap: at least one height is required");
  for (std::size_t i = 1; i < grid.heights_m.size(); ++i) {
    if (!(grid.heights_m[i] > grid.heights_m[i - 1])) throw std::invalid_argument("MagneticMap: heights must increase");
  }
}

/// The constructor's nodes.
class ArrayNodes final : public FieldNodes {
 public:
  ArrayNodes(const FieldGrid& grid, const std::vector<Eigen::Vector4f>& nodes) : grid_(grid), nodes_(nodes) {}

  bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const override {
    for (int i = 0; i < rows; ++i) {
      const std::size_t first = (static_cast<std::size_t>(layer) * grid_.rows + row + i) * grid_.columns + column;
      nodes = std::copy_n(nodes_.begin() + static_cast<std::ptrdiff_t>(first), columns, nodes);
    }
    return true;
  }

 private:
  const FieldGrid& grid_;
  const std::vector<Eigen::Vector4f>& nodes_;
};

}  // namespace

MagneticMap::MagneticMap(FieldGrid grid, const std::vector<Eigen::Vector4f>& nodes, double max_sigma_ut,
                         const FieldMapErrors& errors)
    : grid_(std::move(grid)), max_sigma_ut_(max_sigma_ut), errors_(errors) {
  check_grid(grid_);
  if (nodes.size() != static_cast<std::size_t>(grid_.columns) * grid_.rows * grid_.heights_m.size()) {
    throw std::invalid_argument("MagneticMap: the number of nodes must be columns × rows × layers");
  }
  tiles_ = std::make_shared<FieldTileCache>(grid_, ArrayNodes(grid_, nodes));
}

MagneticMap::MagneticMap(FieldGrid grid, std::shared_ptr<const FieldNodes> nodes, double max_sigma_ut,
                         std::size_t max_bytes, const FieldMapErrors& errors)
    : grid_(std::move(grid)), max_sigma_ut_(max_sigma_ut), errors_(errors) {
  check_grid(grid_);
  tiles_ = std::make_shared<FieldTileCache>(grid_, std::move(nodes), max_bytes);
}

Eigen::Vector4f MagneticMap::node(int layer, int row, int column) const {
  // The grid's last row and column of nodes are the upper ones of the last tile's cells.
  const int tile_row = std::min(row / FieldTile::cells, tiles_->rows() - 1);
  const int tile_column = std::min(column / FieldTile::cells, tiles_->columns() - 1);
  const FieldTile* tile = tiles_->find(layer, tile_row, tile_column);
  if (tile == nullptr) return Eigen::Vector4f::Constant(missing);
  const Eigen::Vector4f& node = *tile->node(row - tile_row * FieldTile::cells, column - tile_column * FieldTile::cells);
  return std::isfinite(node[3]) ? node : Eigen::Vector4f::Constant(missing);
}

std::vector<Eigen::Vector4f> MagneticMap::nodes() const {
  std::vector<Eigen::Vector4f> nodes;
  nodes.reserve(static_cast<std::size_t>(grid_.columns) * grid_.rows * grid_.heights_m.size());
  for (int layer = 0; layer < static_cast<int>(grid_.heights_m.size()); ++layer) {
    for (int row = 0; row < grid_.rows; ++row) {
      for (int column = 0; column < grid_.columns; ++column) nodes.push_back(node(layer, row, column));
    }
  }
  return nodes;
}

void MagneticMap::for_each_node(const std::function<void(const Eigen::Vector4f& node)>& visit) const {
  const auto end = [](int tile, int tiles, int nodes) {
    return tile + 1 == tiles ? nodes : (tile + 1) * FieldTile::cells;
  };
  for (int layer = 0; layer < static_cast<int>(grid_.heights_m.size()); ++layer) {
    for (int tile_row = 0; tile_row < tiles_->rows(); ++tile_row) {
      for (int tile_column = 0; tile_column < tiles_->columns(); ++tile_column) {
        if (tiles_->find(layer, tile_row, tile_column) == nullptr) continue;
        for (int row = tile_row * FieldTile::cells; row < end(tile_row, tiles_->rows(), grid_.rows); ++row) {
          for (int column = tile_column * FieldTile::cells; column < end(tile_column, tiles_->columns(), grid_.columns);
               ++column) {
            if (const Eigen::Vector4f one = node(layer, row, column); std::isfinite(one[3])) visit(one);
          }
        }
      }
    }
  }
}

std::optional<FieldValue> MagneticMap::query(const Vector3& position, FieldInterpolation interpolation) const {
  const double per_metre = 1.0 / grid_.resolution_m;
  CellPosition x;
  CellPosition y;
  if (!locate((position.x() - grid_.origin.x()) * per_metre, grid_.columns, x) ||
      !locate((position.y() - grid_.origin.y()) * per_metre, grid_.rows, y)) {
    return std::nullopt;
  }

  int layer = 0;
  double share = 0.0;
  double spacing = 0.0;  // zero: one layer alone, without a slope in z
  const std::vector<double>& heights = grid_.heights_m;
  if (heights.size() > 1 && position.z() > heights.front()) {
    layer = static_cast<int>(std::upper_bound(heights.begin(), heights.end(), position.z()) - heights.begin()) - 1;
    if (layer + 1 < static_cast<int>(heights.size())) {
      spacing = heights[layer + 1] - heights[layer];
      share = (position.z() - heights[layer]) / spacing;
    }
  }

  const auto evaluate = [&](int index, LayerValue& result) {
    const int tile_row = y.index / FieldTile::cells;
    const int tile_column = x.index / FieldTile::cells;
    const FieldTile* tile = tiles_->find(index, tile_row, tile_column);
    if (tile == nullptr) return false;
    const Eigen::Vector4f* corner =
        tile->node(y.index - tile_row * FieldTile::cells, x.index - tile_column * FieldTile::cells);
    if (interpolation == FieldInterpolation::bilinear) {
      bilinear(corner, x.share, y.share, result);
    } else {
      bicubic(corner, x.share, y.share, result);
      result.value[3] = bilinear_sigma(corner, x.share, y.share);
    }
    return true;
  };

  LayerValue lower;
  if (!evaluate(layer, lower)) return std::nullopt;
  FieldValue result;
  if (spacing > 0.0) {
    LayerValue upper;
    if (!evaluate(layer + 1, upper)) return std::nullopt;
    result.gradient.col(2) = (upper.value - lower.value).head<3>() / spacing;
    lower.value += share * (upper.value - lower.value);
    lower.along_x += share * (upper.along_x - lower.along_x);
    lower.along_y += share * (upper.along_y - lower.along_y);
  }
  result.sigma_ut = lower.value[3];
  if (!(result.sigma_ut <= max_sigma_ut_)) return std::nullopt;  // also true for NaN, a corner without field
  result.field_ut = lower.value.head<3>();
  result.gradient.col(0) = lower.along_x.head<3>() * per_metre;
  result.gradient.col(1) = lower.along_y.head<3>() * per_metre;
  return result;
}

}  // namespace lodestone
