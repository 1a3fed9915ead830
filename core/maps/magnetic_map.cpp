#include "core/maps/magnetic_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace lodestone {
namespace {

constexpr float missing = std::numeric_limits<float>::quiet_NaN();

bool has_field(const Eigen::Vector4f& node) { return node.allFinite(); }

/// A point of one axis of the grid: cell index and the share of the way to the next node.
struct CellPosition {
  int index = 0;
  double share = 0.0;
};

/// False outside [0, nodes − 1]. The far edge belongs to the last cell; rounding at an edge is forgiven.
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

/// `corner` points at the cell's node of lowest row and column.
void bilinear(const Eigen::Vector4f* corner, int stride, double s, double t, LayerValue& result) {
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

void bicubic(const Eigen::Vector4f* corner, int stride, double s, double t, LayerValue& result) {
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

double bilinear_sigma(const Eigen::Vector4f* corner, int stride, double s, double t) {
  const double lower = corner[0][3] + s * (static_cast<double>(corner[1][3]) - corner[0][3]);
  const double upper = corner[stride][3] + s * (static_cast<double>(corner[stride + 1][3]) - corner[stride][3]);
  return lower + t * (upper - lower);
}

}  // namespace

MagneticMap::MagneticMap(FieldGrid grid, const std::vector<Eigen::Vector4f>& nodes, double max_sigma_ut)
    : grid_(std::move(grid)), max_sigma_ut_(max_sigma_ut) {
  if (grid_.columns < 2 || grid_.rows < 2) throw std::invalid_argument("a magnetic map needs two nodes a side");
  if (!(grid_.resolution_m > 0.0)) throw std::invalid_argument("a magnetic map's resolution must be positive");
  if (grid_.heights_m.empty()) throw std::invalid_argument("a magnetic map needs a height");
  for (std::size_t i = 1; i < grid_.heights_m.size(); ++i) {
    if (!(grid_.heights_m[i] > grid_.heights_m[i - 1])) throw std::invalid_argument("map heights must increase");
  }
  const int layers = static_cast<int>(grid_.heights_m.size());
  if (nodes.size() != static_cast<std::size_t>(grid_.columns) * grid_.rows * layers) {
    throw std::invalid_argument("a magnetic map's nodes must be columns × rows × layers");
  }
  padded_.assign(static_cast<std::size_t>(grid_.columns + 2) * (grid_.rows + 2) * layers,
                 Eigen::Vector4f::Constant(missing));
  std::size_t next = 0;
  for (int layer = 0; layer < layers; ++layer) {
    for (int row = 0; row < grid_.rows; ++row) {
      for (int column = 0; column < grid_.columns; ++column, ++next) {
        if (has_field(nodes[next])) padded_[padded_index(layer, row, column)] = nodes[next];
      }
    }
    fill_ghosts(layer);
  }
}

void MagneticMap::fill_ghosts(int layer) {
  // Two rounds of four directions: along the axes, else along the diagonals. A ghost's value depends on the node alone,
  // not on the cell that asks, which keeps bicubic patches C¹ along the edge of the field.
  constexpr int directions[2][4][2] = {{{0, 1}, {0, -1}, {1, 0}, {-1, 0}}, {{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
  const auto at = [&](int row, int column) -> const Eigen::Vector4f* {
    if (row < 0 || column < 0 || row >= grid_.rows || column >= grid_.columns) return nullptr;
    const Eigen::Vector4f& node = padded_[padded_index(layer, row, column)];
    return std::isfinite(node[3]) ? &node : nullptr;  // ghosts have σ = NaN: none is made from another
  };
  for (int row = -1; row <= grid_.rows; ++row) {
    for (int column = -1; column <= grid_.columns; ++column) {
      if (at(row, column)) continue;
      for (const auto& round : directions) {
        Eigen::Vector4f sum = Eigen::Vector4f::Zero();
        int count = 0;
        for (const auto& step : round) {
          const Eigen::Vector4f* near = at(row + step[0], column + step[1]);
          const Eigen::Vector4f* far = at(row + 2 * step[0], column + 2 * step[1]);
          if (!near || !far) continue;
          sum += 2.0F * *near - *far;
          ++count;
        }
        if (count == 0) continue;
        Eigen::Vector4f& ghost = padded_[padded_index(layer, row, column)];
        ghost = sum / static_cast<float>(count);
        ghost[3] = missing;
        break;
      }
    }
  }
}

Eigen::Vector4f MagneticMap::node(int layer, int row, int column) const {
  const Eigen::Vector4f& node = padded_[padded_index(layer, row, column)];
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
  double spacing = 0.0;  // zero: one layer answers alone, and there is no slope in z
  const std::vector<double>& heights = grid_.heights_m;
  if (heights.size() > 1 && position.z() > heights.front()) {
    layer = static_cast<int>(std::upper_bound(heights.begin(), heights.end(), position.z()) - heights.begin()) - 1;
    if (layer + 1 < static_cast<int>(heights.size())) {
      spacing = heights[layer + 1] - heights[layer];
      share = (position.z() - heights[layer]) / spacing;
    }
  }

  const int stride = grid_.columns + 2;
  const auto evaluate = [&](int index, LayerValue& result) {
    const Eigen::Vector4f* corner = &padded_[padded_index(index, y.index, x.index)];
    if (interpolation == FieldInterpolation::bilinear) {
      bilinear(corner, stride, x.share, y.share, result);
    } else {
      bicubic(corner, stride, x.share, y.share, result);
      result.value[3] = bilinear_sigma(corner, stride, x.share, y.share);
    }
  };

  LayerValue lower;
  evaluate(layer, lower);
  FieldValue result;
  if (spacing > 0.0) {
    LayerValue upper;
    evaluate(layer + 1, upper);
    result.gradient.col(2) = (upper.value - lower.value).head<3>() / spacing;
    lower.value += share * (upper.value - lower.value);
    lower.along_x += share * (upper.along_x - lower.along_x);
    lower.along_y += share * (upper.along_y - lower.along_y);
  }
  result.sigma_ut = lower.value[3];
  if (!(result.sigma_ut <= max_sigma_ut_)) return std::nullopt;  // NaN, a corner without field, fails as well
  result.field_ut = lower.value.head<3>();
  result.gradient.col(0) = lower.along_x.head<3>() * per_metre;
  result.gradient.col(1) = lower.along_y.head<3>() * per_metre;
  return result;
}

}  // namespace lodestone
