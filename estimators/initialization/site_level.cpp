#include "estimators/initialization/site_level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/lidar/plane_fit.h"

namespace lodestone {

namespace {

constexpr double kFloorCosine = 0.97;  // 14°: steeper surfaces are no floor
constexpr double kJoin_m = 0.5;        // largest gap between connected floor cells
constexpr double kJoinSlope = 0.3;
constexpr double kJoinStep_m = 0.06;
constexpr double kStandBeyond_m = 1.0;  // holes in a survey's floor
constexpr double kLeastArea_m2 = 4.0;
constexpr double kLeastLevelShare = 0.1;

/// A horizontal piece of surface.
struct FloorPiece {
  int column;
  int row;
  float height_m;
};

struct Extent {
  Eigen::Vector2i low{std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
  Eigen::Vector2i high{std::numeric_limits<int>::min(), std::numeric_limits<int>::min()};
};

struct CellOfVoxel {
  double voxel_m;
  double cell_m;
  Eigen::Vector3d center(const Eigen::Vector3i& voxel) const { return voxel_m * (voxel.cast<double>().array() + 0.5); }
  Eigen::Vector2i operator()(const Eigen::Vector3i& voxel) const {
    return (center(voxel).head<2>() / cell_m).array().floor().cast<int>();
  }
};

std::vector<FloorPiece> find_pieces(const PlaneMapSource& map, const CellOfVoxel& cell_of, Extent& extent) {
  std::vector<FloorPiece> pieces;
  map.for_each_voxel([&](const Eigen::Vector3i& voxel, const Plane* plane) {
    const Eigen::Vector2i cell = cell_of(voxel);
    extent.low = extent.low.cwiseMin(cell);
    extent.high = extent.high.cwiseMax(cell);
    if (plane == nullptr || std::abs(plane->normal.z()) < kFloorCosine) return;
    const Eigen::Vector2d offset = cell_of.center(voxel).head<2>() - plane->center.head<2>().cast<double>();
    const double slope = plane->normal.head<2>().cast<double>().dot(offset) / static_cast<double>(plane->normal.z());
    pieces.push_back({cell.x(), cell.y(), plane->center.z() - static_cast<float>(slope)});
  });
  std::sort(pieces.begin(), pieces.end(), [](const FloorPiece& a, const FloorPiece& b) {
    return std::tie(a.row, a.column, a.height_m) < std::tie(b.row, b.column, b.height_m);
  });
  // A floor in the face between two voxels is a plane of both.
  const float same_m = static_cast<float>(0.5 * cell_of.voxel_m);
  const auto same = [same_m](const FloorPiece& a, const FloorPiece& b) {
    return a.row == b.row && a.column == b.column && b.height_m - a.height_m < same_m;
  };
  pieces.erase(std::unique(pieces.begin(), pieces.end(), same), pieces.end());
  return pieces;
}

/// Sets of pieces that a robot could drive between.
class Surfaces {
 public:
  Surfaces(const std::vector<FloorPiece>& pieces, const Extent& extent, double cell_m) : parent_(pieces.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    const int columns = extent.high.x() - extent.low.x() + 1;
    const int rows = extent.high.y() - extent.low.y() + 1;
    std::vector<std::int32_t> first(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) + 1, 0);
    const auto slot = [&](int column, int row) {
      return static_cast<std::size_t>(row - extent.low.y()) * static_cast<std::size_t>(columns) +
             static_cast<std::size_t>(column - extent.low.x());
    };
    for (const FloorPiece& piece : pieces) ++first[slot(piece.column, piece.row) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    const int reach = std::max(1, static_cast<int>(kJoin_m / cell_m));
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const FloorPiece& piece = pieces[i];
      for (int row = piece.row; row <= std::min(piece.row + reach, extent.high.y()); ++row) {
        const int begin = row == piece.row ? piece.column + 1 : std::max(piece.column - reach, extent.low.x());
        for (int column = begin; column <= std::min(piece.column + reach, extent.high.x()); ++column) {
          const double distance_m = cell_m * std::hypot(row - piece.row, column - piece.column);
          for (std::int32_t j = first[slot(column, row)]; j < first[slot(column, row) + 1]; ++j) {
            const double step_m = std::abs(pieces[static_cast<std::size_t>(j)].height_m - piece.height_m);
            if (step_m <= kJoinStep_m + kJoinSlope * distance_m) join(static_cast<std::int32_t>(i), j);
          }
        }
      }
    }
  }

  std::int32_t root(std::int32_t piece) {
    while (parent_[static_cast<std::size_t>(piece)] != piece) {
      std::int32_t& up = parent_[static_cast<std::size_t>(piece)];
      up = parent_[static_cast<std::size_t>(up)];
      piece = up;
    }
    return piece;
  }

 private:
  void join(std::int32_t a, std::int32_t b) {
    a = root(a);
    b = root(b);
    parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }
  std::vector<std::int32_t> parent_;
};

/// Pieces of each level, the largest first.
std::vector<std::vector<FloorPiece>> part(const std::vector<FloorPiece>& pieces, Surfaces& surfaces, double cell_m) {
  std::map<std::pair<std::int32_t, int>, std::vector<FloorPiece>> levels;  // by surface and storey
  std::vector<std::int32_t> here;                                          // surfaces in this cell so far
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (i > 0 && (pieces[i].column != pieces[i - 1].column || pieces[i].row != pieces[i - 1].row)) here.clear();
    const std::int32_t root = surfaces.root(static_cast<std::int32_t>(i));
    levels[{root, static_cast<int>(std::count(here.begin(), here.end(), root))}].push_back(pieces[i]);
    here.push_back(root);
  }
  std::size_t most = 0;
  for (const auto& [key, level] : levels) most = std::max(most, level.size());
  const double least = std::max(kLeastArea_m2 / (cell_m * cell_m), kLeastLevelShare * static_cast<double>(most));
  std::vector<std::vector<FloorPiece>> result;
  for (auto& [key, level] : levels) {
    if (static_cast<double>(level.size()) >= least) result.push_back(std::move(level));
  }
  std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return result;
}

/// Extends the floor's height outwards over the whole grid. A robot can stand on the cells next to the floor.
void spread_floor(SiteLevel& level) {
  const int stand = std::max(1, static_cast<int>(std::lround(kStandBeyond_m / level.cell_m)));
  std::vector<std::size_t> ring;
  for (std::size_t i = 0; i < level.cells.size(); ++i) {
    if (std::isfinite(level.floor_m[i])) ring.push_back(i);
  }
  for (int steps = 1; !ring.empty(); ++steps) {
    std::vector<std::size_t> next;
    for (const std::size_t i : ring) {
      const int column = static_cast<int>(i % static_cast<std::size_t>(level.columns));
      const int row = static_cast<int>(i / static_cast<std::size_t>(level.columns));
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!level.contains(column + dx, row + dy)) continue;
        const std::size_t j = level.index(column + dx, row + dy);
        if (std::isfinite(level.floor_m[j])) continue;
        level.floor_m[j] = level.floor_m[i];
        if (steps <= stand) level.cells[j] |= SiteLevel::standable;
        next.push_back(j);
      }
    }
    ring = std::move(next);
  }
}

/// The place is known to one cell, a scan point to half a cell more; bits therefore extend to the neighbours.
void widen(SiteLevel& level) {
  const std::vector<std::uint32_t> before = level.cells;
  constexpr std::uint32_t kBands = ~SiteLevel::standable;
  for (int row = 0; row < level.rows; ++row) {
    for (int column = 0; column < level.columns; ++column) {
      const std::uint32_t bits = before[level.index(column, row)] & kBands;
      if (bits == 0) continue;
      for (int y = std::max(row - 1, 0); y <= std::min(row + 1, level.rows - 1); ++y) {
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, level.columns - 1); ++x) {
          level.cells[level.index(x, y)] |= bits;
        }
      }
    }
  }
}

}  // namespace

std::uint32_t SiteLevel::band_mask(double low_m, double high_m) {
  const int first = std::max(0, static_cast<int>(std::floor(low_m / band_m)));
  const int last = std::min(bands - 1, static_cast<int>(std::floor(high_m / band_m)));
  std::uint32_t mask = 0;
  for (int band = first; band <= last; ++band) mask |= 1U << static_cast<unsigned>(band);
  return mask;
}

std::vector<SiteLevel> find_levels(const PlaneMapSource& map, int margin_cells) {
  const CellOfVoxel cell_of{map.voxel_m(), std::max(0.25, map.voxel_m())};
  Extent extent;
  const std::vector<FloorPiece> pieces = find_pieces(map, cell_of, extent);
  if (pieces.empty()) return {};
  Surfaces surfaces(pieces, extent, cell_of.cell_m);
  std::vector<SiteLevel> levels;
  for (const std::vector<FloorPiece>& floor : part(pieces, surfaces, cell_of.cell_m)) {
    SiteLevel level;
    level.cell_m = cell_of.cell_m;
    level.origin_m = cell_of.cell_m * (extent.low.array() - margin_cells).cast<double>();
    level.columns = extent.high.x() - extent.low.x() + 1 + 2 * margin_cells;
    level.rows = extent.high.y() - extent.low.y() + 1 + 2 * margin_cells;
    const std::size_t count = static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows);
    level.floor_m.assign(count, std::numeric_limits<float>::quiet_NaN());
    level.cells.assign(count, 0);
    for (const FloorPiece& piece : floor) {
      const std::size_t i =
          level.index(piece.column - extent.low.x() + margin_cells, piece.row - extent.low.y() + margin_cells);
      level.floor_m[i] = piece.height_m;
      level.cells[i] |= SiteLevel::standable;
    }
    spread_floor(level);
    levels.push_back(std::move(level));
  }
  map.for_each_voxel([&](const Eigen::Vector3i& voxel, const Plane*) {
    const Eigen::Vector2i cell = cell_of(voxel) - extent.low + Eigen::Vector2i::Constant(margin_cells);
    const double z = cell_of.center(voxel).z();
    for (SiteLevel& level : levels) {
      const std::size_t i = level.index(cell.x(), cell.y());
      const double height_m = z - static_cast<double>(level.floor_m[i]);
      if (height_m >= SiteLevel::clearance_m) level.cells[i] |= SiteLevel::band_mask(height_m, height_m);
    }
  });
  for (SiteLevel& level : levels) widen(level);
  return levels;
}

}  // namespace lodestone
