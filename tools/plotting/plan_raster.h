#pragma once

#include <limits>
#include <opencv2/core/mat.hpp>

#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_difference.h"
#include "core/magnetometer/magnetic_map.h"
#include "tools/plotting/axes.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone {

/// Values on a regular grid of the floor plan: node (column i, row j) is at (x_m, y_m) + resolution_m * (i, j), map
/// frame. Row 0 has the smallest y. Copies share their values.
struct PlanRaster {
  double resolution_m = 0.1;
  double x_m = 0.0;
  double y_m = 0.0;
  double height_m = 0.0;
  cv::Mat1f values;  ///< NaN: no value

  bool empty() const { return values.empty(); }
  double x_high() const { return x_m + resolution_m * (values.cols - 1); }
  double y_high() const { return y_m + resolution_m * (values.rows - 1); }
};

/// An unlimited extent.
PlanExtent whole_plan();

/// |B| at a point of the map frame, µT; NaN if the map has no field there.
double strength_at(const MagneticMap& map, const Vector3& point);

/// |B|, µT, at height `height_m` within `extent`, at the map's resolution, or coarser for at most `limit` values. Empty
/// if extent and map do not overlap.
PlanRaster strength_raster(const MagneticMap& map, double height_m, const PlanExtent& extent = whole_plan(),
                           std::size_t limit = std::numeric_limits<std::size_t>::max());

/// |B_reference − B_other|, µT, at the nodes of `other`, at height `height_m`; NaN if one of the maps has no field.
PlanRaster difference_raster(const MagneticMap& reference, const MagneticMap& other, double height_m);

/// The largest |ΔB| over the layers, µT, at the nodes of the first map; NaN if a node was not compared. The raster
/// covers the pieces of the difference. Throws InputError for more than 2^28 nodes.
PlanRaster change_raster(const MagneticDifference& difference);

/// Reduces the raster to at most `limit` values: each is the mean of a square of neighbours.
PlanRaster coarsened(const PlanRaster& raster, std::size_t limit);

/// A grid of points: (x_m + i * x_step_m, y_m + j * y_step_m). Steps may be negative.
struct PlanPoints {
  double x_m = 0.0;
  double y_m = 0.0;
  double x_step_m = 0.1;
  double y_step_m = 0.1;
  cv::Size count;
};

enum class RasterInterpolation { nearest, bilinear };

/// The raster at these points. NaN outside the raster and next to a node without a value.
cv::Mat1f values_at(const PlanRaster& raster, const PlanPoints& points,
                    RasterInterpolation interpolation = RasterInterpolation::bilinear);

/// 255 for pixels without value, otherwise 0. OpenCV's comparison treats NaN as equal to itself.
cv::Mat1b without_value(const cv::Mat1f& values);

/// The mean z of a drive, metres; 0 if it is empty.
double mean_height(const Trajectory& drive);

/// The quantile for a share (0 to 1) of the finite values; NaN if there are none.
double quantile(const cv::Mat1f& values, double share);

/// From the 1 % to the 99 % quantile, so that single strong nodes do not dominate the scale; 0 to 1 without a value.
Scale strength_scale(const cv::Mat1f& values_ut);

}  // namespace lodestone
