#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/lidar/plane_map_source.h"

namespace lodestone {

/// One floor of the site and the content of the map above it, as square cells. Each cell has the floor's height and one
/// bit for each height band in which the map has points. Heights are relative to the floor, so that ramps and storeys
/// look the same to a robot.
struct SiteLevel {
  static constexpr double band_m = 0.3;  ///< bit b: from b to b + 1 bands above the floor
  static constexpr int bands = 31;
  static constexpr std::uint32_t standable = 1U << 31U;  ///< bit: floor in this cell, or within a metre
  static constexpr double clearance_m = 0.2;             ///< points below are the floor and its noise

  double cell_m = 0.25;
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();  ///< corner of cell (0, 0), map
  int columns = 0;
  int rows = 0;
  std::vector<float> floor_m;        ///< map z, row by row; beyond the floor's edges, the height of the nearest floor
  std::vector<std::uint32_t> cells;  ///< row by row

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  bool contains(int column, int row) const { return column >= 0 && column < columns && row >= 0 && row < rows; }
  int column_of(double x) const { return static_cast<int>(std::floor((x - origin_m.x()) / cell_m)); }
  int row_of(double y) const { return static_cast<int>(std::floor((y - origin_m.y()) / cell_m)); }
  Eigen::Vector2d center(int column, int row) const {
    return origin_m + cell_m * Eigen::Vector2d(column + 0.5, row + 0.5);
  }

  /// Bits of the bands that the heights from `low_m` to `high_m` above the floor overlap; 0 if there are none.
  static std::uint32_t band_mask(double low_m, double high_m);
};

/// The floors of a map: connected, level or gently sloping surfaces with at least a tenth of the area of the largest.
/// Storeys joined by a ramp are separated where one lies above the other. The cell size is that of the map's voxels, at
/// least 0.25 m. Each grid covers the whole map and `margin_cells` around it. The result does not depend on the storage
/// of the map. Empty if the map has no level surface.
std::vector<SiteLevel> find_levels(const PlaneMapSource& map, int margin_cells);

}  // namespace lodestone
