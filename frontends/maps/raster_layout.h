#pragma once

#include <Eigen/Core>
#include <opencv2/core/types.hpp>

namespace lodestone {

/// Size and place of a raster. Pixels are nodes: pixel (column, row) lies at origin + pixel_m * (column, row). Windows
/// (cv::Rect) and matrices count rows from below, as y increases. Files count rows from above; only the reader and the
/// writer know.
struct RasterLayout {
  cv::Size size;  ///< columns, rows
  double pixel_m = 1.0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< map x, y of pixel (0, 0)
};

}  // namespace lodestone
