#include "core/magnetometer/magnetic_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "core/middle_value.h"
#include "core/parallel.h"

namespace lodestone {
namespace {

constexpr int piece_nodes = 64;

Vector3 node_position(const FieldGrid& grid, int layer, int row, int column) {
  return {grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
          grid.heights_m[layer]};
}

/// A map's field and sigma at one place.
struct MapSample {
  Vector3 field_ut;
  double sigma_ut;
};

/// At a node of the map, the node's value: interpolation at the edge of the field may require a neighbour that is not
/// there.
std::optional<MapSample> sample(const MagneticMap& map, const Vector3& position) {
  const FieldGrid& grid = map.grid();
  const Eigen::Array2d place = (position.head<2>() - grid.origin).array() / grid.resolution_m;
  const Eigen::Array2d nearest = place.round();
  const auto height = std::find(grid.heights_m.begin(), grid.heights_m.end(), position.z());
  const bool at_height = grid.heights_m.size() == 1 || height != grid.heights_m.end();
  if (at_height && (place - nearest).abs().maxCoeff() < 1e-6 && nearest.minCoeff() >= 0.0 &&
      nearest.x() < grid.columns && nearest.y() < grid.rows) {
    const auto layer = grid.heights_m.size() == 1 ? 0 : static_cast<int>(height - grid.heights_m.begin());
    const Eigen::Vector4f node = map.node(layer, static_cast<int>(nearest.y()), static_cast<int>(nearest.x()));
    if (!(node[3] <= map.max_sigma_ut())) return std::nullopt;
    return MapSample{node.head<3>().cast<double>(), node[3]};
  }
  const auto value = map.query(position, FieldInterpolation::bicubic);
  if (!value) return std::nullopt;
  return MapSample{value->field_ut, value->sigma_ut};
}

/// One rectangle of a grid, and how many of its places have field in one map only.
struct Compared {
  DifferencePiece piece;
  std::int64_t compared = 0;  ///< places (x, y)
  std::int64_t alone = 0;
};

/// Calls `visit(row, column, rows, columns)` for the rectangles of the grid, from any thread, with their index.
template <class Visit>
std::size_t for_each_piece(const FieldGrid& grid, Visit&& visit) {
  const std::size_t across = static_cast<std::size_t>((grid.columns + piece_nodes - 1) / piece_nodes);
  const std::size_t up = static_cast<std::size_t>((grid.rows + piece_nodes - 1) / piece_nodes);
  parallel_for(std::size_t{0}, across * up, [&](std::size_t index) {
    const int row = static_cast<int>(index / across) * piece_nodes;
    const int column = static_cast<int>(index % across) * piece_nodes;
    visit(index, row, column, std::min(piece_nodes, grid.rows - row), std::min(piece_nodes, grid.columns - column));
  });
  return across * up;
}

std::size_t piece_count(const FieldGrid& grid) {
  return static_cast<std::size_t>((grid.columns + piece_nodes - 1) / piece_nodes) *
         static_cast<std::size_t>((grid.rows + piece_nodes - 1) / piece_nodes);
}

void compare_piece(const MagneticMap& first, const MagneticMap& second, Compared& result) {
  const FieldGrid& grid = first.grid();
  DifferencePiece& piece = result.piece;
  const int layers = static_cast<int>(grid.heights_m.size());
  const std::size_t places = static_cast<std::size_t>(piece.rows) * piece.columns;
  std::vector<char> seen(places, 0);
  piece.nodes.assign(places * layers, Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN()));
  piece.largest_layer.assign(places, -1);
  for (int layer = 0; layer < layers; ++layer) {
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        const Eigen::Vector4f node = first.node(layer, piece.row + row, piece.column + column);
        if (!(node[3] <= first.max_sigma_ut())) continue;  // NaN as well
        const std::size_t place = static_cast<std::size_t>(row) * piece.columns + column;
        seen[place] = 1;
        const auto other = sample(second, node_position(grid, layer, piece.row + row, piece.column + column));
        if (!other) continue;
        const Vector3 change = other->field_ut - node.head<3>().cast<double>();
        const double sigma = std::hypot(static_cast<double>(node[3]), other->sigma_ut);
        Eigen::Vector4f& entry = piece.nodes[static_cast<std::size_t>(layer) * places + place];
        entry << change.cast<float>(), static_cast<float>(sigma);
        std::int16_t& largest = piece.largest_layer[place];
        if (largest < 0 || entry.head<3>().norm() > piece.at(largest, row, column).head<3>().norm()) {
          largest = static_cast<std::int16_t>(layer);
        }
      }
    }
  }
  for (std::size_t place = 0; place < places; ++place) {
    if (piece.largest_layer[place] >= 0) {
      ++result.compared;
    } else {
      result.alone += seen[place];
    }
  }
  if (result.compared == 0) {
    piece.nodes = {};
    piece.largest_layer = {};
  }
}

/// Area of places of `map` where `other` has field in no layer of `map`.
double area_without(const MagneticMap& map, const MagneticMap& other) {
  const FieldGrid& grid = map.grid();
  std::vector<std::int64_t> alone(piece_count(grid), 0);
  for_each_piece(grid, [&](std::size_t index, int first_row, int first_column, int rows, int columns) {
    for (int row = first_row; row < first_row + rows; ++row) {
      for (int column = first_column; column < first_column + columns; ++column) {
        bool here = false;
        bool there = false;
        for (int layer = 0; layer < static_cast<int>(grid.heights_m.size()) && !there; ++layer) {
          if (!(map.node(layer, row, column)[3] <= map.max_sigma_ut())) continue;
          here = true;
          there = sample(other, node_position(grid, layer, row, column)).has_value();
        }
        alone[index] += here && !there;
      }
    }
  });
  return static_cast<double>(std::accumulate(alone.begin(), alone.end(), std::int64_t{0})) * grid.resolution_m *
         grid.resolution_m;
}

void add_figures(MagneticDifference& result) {
  std::vector<float> changes;
  double sum = 0.0;
  double squares = 0.0;
  double normalized = 0.0;
  std::int64_t above = 0;
  const FieldGrid& grid = result.grid;
  for (const DifferencePiece& piece : result.pieces) {
    for (int layer = 0; layer < static_cast<int>(grid.heights_m.size()); ++layer) {
      for (int row = 0; row < piece.rows; ++row) {
        for (int column = 0; column < piece.columns; ++column) {
          const Eigen::Vector4f& node = piece.at(layer, row, column);
          if (!std::isfinite(node[3])) continue;
          const double change = node.head<3>().cast<double>().norm();
          changes.push_back(static_cast<float>(change));
          sum += change;
          squares += change * change;
          const double ratio = node[3] > 0.0F ? change / static_cast<double>(node[3]) : 0.0;
          normalized += ratio * ratio;
          above += ratio > 3.0;
          if (changes.size() > 1 && !(change > result.largest_ut)) continue;
          result.largest_ut = change;
          result.largest_at = node_position(grid, layer, piece.row + row, piece.column + column);
        }
      }
    }
  }
  if (changes.empty()) return;
  const auto count = static_cast<double>(changes.size());
  result.nodes = static_cast<std::int64_t>(changes.size());
  result.mean_ut = sum / count;
  result.rms_ut = std::sqrt(squares / count);
  result.high_ut = value_at_share(changes, 0.95);
  result.normalized_rms = std::sqrt(normalized / count / 3.0);
  result.share_above_three_sigma = static_cast<double>(above) / count;
}

}  // namespace

double DifferencePiece::change(int piece_row, int piece_column) const {
  const std::int16_t layer = largest_layer[static_cast<std::size_t>(piece_row) * columns + piece_column];
  return layer < 0 ? -1.0 : at(layer, piece_row, piece_column).head<3>().cast<double>().norm();
}

MagneticDifference compare_maps(const MagneticMap& first, const MagneticMap& second) {
  MagneticDifference result;
  result.grid = first.grid();
  result.sigma_shares =
      ((first.errors().sigma_shares.cwiseAbs2() + second.errors().sigma_shares.cwiseAbs2()) / 2.0).cwiseSqrt();
  std::vector<Compared> compared(piece_count(result.grid));
  for_each_piece(result.grid, [&](std::size_t index, int row, int column, int rows, int columns) {
    compared[index].piece = {column, row, columns, rows, {}, {}};
    compare_piece(first, second, compared[index]);
  });
  const double node_m2 = result.grid.resolution_m * result.grid.resolution_m;
  for (Compared& one : compared) {
    result.compared_m2 += static_cast<double>(one.compared) * node_m2;
    result.only_first_m2 += static_cast<double>(one.alone) * node_m2;
    if (one.compared > 0) result.pieces.push_back(std::move(one.piece));
  }
  result.only_second_m2 = area_without(second, first);
  add_figures(result);
  return result;
}

}  // namespace lodestone
