#pragma once

#include <Eigen/Core>

namespace lodestone {

/// Size and place of a raster. Pixels are nodes: pixel (column, row) lies at origin + pixel_m * (column, row), rows counted
/// from below, as y goes. Files have them from above, as pictures do; only the reader and the writer know.
struct RasterLayout {
  int columns = 0;
  int rows = 0;
  double pixel_m = 1.0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< map x, y of pixel (0, 0)
};

/// A rectangle of pixels: the lowest column and row, and how many of each.
struct RasterWindow {
  int column = 0;
  int row = 0;
  int columns = 0;
  int rows = 0;
};

}  // namespace lodestone
