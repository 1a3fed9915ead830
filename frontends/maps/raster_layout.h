#pragma once

#include <Eigen/Core>
#include <opencv2/core/types.hpp>

namespace lodestone {

/// Size and position of a raster. Pixels are nodes: pixel (column, row) is at origin + pixel_m * (column, row). Windows
/// (cv::Rect) and matrices count rows from below, with increasing y. Files count rows from above; only reader and
/// writer convert.
struct RasterLayout {
  cv::Size size;  ///< columns, rows
  double pixel_m = 1.0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< map x, y of pixel (0, 0)
};

}  // namespace lodestone
