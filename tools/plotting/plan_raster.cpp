#include "tools/plotting/plan_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

/// OpenCV's warps use 16-bit pixel coordinates.
constexpr int kLongestSide = 30'000;

/// Means of `factor` by `factor` neighbours, of those with a value.
PlanRaster downsampled(const PlanRaster& raster, int factor) {
  const cv::Size size((raster.values.cols + factor - 1) / factor, (raster.values.rows + factor - 1) / factor);
  cv::Mat values;
  cv::copyMakeBorder(raster.values, values, 0, size.height * factor - raster.values.rows, 0,
                     size.width * factor - raster.values.cols, cv::BORDER_CONSTANT, cv::Scalar(kNoValue));
  const cv::Mat known = ~without_value(values);
  cv::Mat weights;
  known.convertTo(weights, CV_32F, 1.0 / 255.0);
  values.setTo(0.0, ~known);
  cv::resize(values, values, size, 0.0, 0.0, cv::INTER_AREA);
  cv::resize(weights, weights, size, 0.0, 0.0, cv::INTER_AREA);
  PlanRaster result = raster;
  result.resolution_m = raster.resolution_m * factor;
  result.x_m = raster.x_m + 0.5 * (factor - 1) * raster.resolution_m;
  result.y_m = raster.y_m + 0.5 * (factor - 1) * raster.resolution_m;
  result.values = values / weights;
  result.values.setTo(kNoValue, weights <= 0.0);
  return result;
}

/// The indices from 0 to count − 1 with first + step * index in [low, high].
cv::Range indices_within(double first, double step, int count, double low, double high) {
  const double at_low = (low - first) / step;
  const double at_high = (high - first) / step;
  const double begin = std::clamp(std::ceil(std::min(at_low, at_high)), 0.0, static_cast<double>(count));
  const double end = std::clamp(std::floor(std::max(at_low, at_high)) + 1.0, begin, static_cast<double>(count));
  return {static_cast<int>(begin), static_cast<int>(end)};
}

}  // namespace

PlanExtent whole_plan() {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  return {-kFar, kFar, -kFar, kFar};
}

double strength_at(const MagneticMap& map, const Vector3& point) {
  const auto value = map.query(point, FieldInterpolation::bilinear);
  return value ? value->field_ut.norm() : std::numeric_limits<double>::quiet_NaN();
}

PlanRaster strength_raster(const MagneticMap& map, double height_m, const PlanExtent& extent, std::size_t limit) {
  const FieldGrid& grid = map.grid();
  PlanRaster raster;
  raster.height_m = height_m;
  raster.x_m = std::max(extent.x_low, grid.origin.x());
  raster.y_m = std::max(extent.y_low, grid.origin.y());
  const double x_high = std::min(extent.x_high, grid.origin.x() + grid.resolution_m * (grid.columns - 1));
  const double y_high = std::min(extent.y_high, grid.origin.y() + grid.resolution_m * (grid.rows - 1));
  const double width = x_high - raster.x_m;
  const double height = y_high - raster.y_m;
  if (!(width > 0.0) || !(height > 0.0)) return raster;
  raster.resolution_m = std::max(grid.resolution_m, std::sqrt(width * height / static_cast<double>(limit)));
  // One more value would be on the map's edge, or beyond it after rounding.
  raster.values.create(static_cast<int>(height / raster.resolution_m + 1e-6) + 1,
                       static_cast<int>(width / raster.resolution_m + 1e-6) + 1);
  for (int row = 0; row < raster.values.rows; ++row) {
    for (int column = 0; column < raster.values.cols; ++column) {
      raster.values(row, column) =
          static_cast<float>(strength_at(map, {std::min(x_high, raster.x_m + raster.resolution_m * column),
                                               std::min(y_high, raster.y_m + raster.resolution_m * row), height_m}));
    }
  }
  return raster;
}

PlanRaster difference_raster(const MagneticMap& reference, const MagneticMap& other, double height_m) {
  const FieldGrid& grid = other.grid();
  PlanRaster raster{grid.resolution_m, grid.origin.x(), grid.origin.y(), height_m, {}};
  raster.values.create(grid.rows, grid.columns);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector3 point{raster.x_m + grid.resolution_m * column, raster.y_m + grid.resolution_m * row, height_m};
      const auto there = reference.query(point, FieldInterpolation::bilinear);
      const auto here = other.query(point, FieldInterpolation::bilinear);
      raster.values(row, column) =
          there && here ? static_cast<float>((there->field_ut - here->field_ut).norm()) : kNoValue;
    }
  }
  return raster;
}

PlanRaster change_raster(const MagneticDifference& difference) {
  cv::Rect box;
  for (const DifferencePiece& piece : difference.pieces)
    box |= cv::Rect(piece.column, piece.row, piece.columns, piece.rows);
  constexpr double kMostNodes = 1U << 28U;
  if (static_cast<double>(box.width) * box.height > kMostNodes) {
    throw InputError(
        fmt::format("the maps have {} x {} nodes in common; at most {:.0f} can be compared; use a coarser first map",
                    box.width, box.height, kMostNodes));
  }
  const FieldGrid& grid = difference.grid;
  PlanRaster raster{grid.resolution_m, grid.origin.x() + grid.resolution_m * box.x,
                    grid.origin.y() + grid.resolution_m * box.y, 0.0, cv::Mat1f(box.size(), kNoValue)};
  for (const DifferencePiece& piece : difference.pieces) {
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        const double change = piece.change(row, column);
        if (change < 0.0) continue;
        raster.values(piece.row - box.y + row, piece.column - box.x + column) = static_cast<float>(change);
      }
    }
  }
  return raster;
}

PlanRaster coarsened(const PlanRaster& raster, std::size_t limit) {
  const double share = static_cast<double>(raster.values.total()) / static_cast<double>(limit);
  return share <= 1.0 ? raster : downsampled(raster, static_cast<int>(std::ceil(std::sqrt(share))));
}

cv::Mat1f values_at(const PlanRaster& raster, const PlanPoints& points, RasterInterpolation interpolation) {
  cv::Mat1f result(points.count, kNoValue);
  if (raster.values.cols < 2 || raster.values.rows < 2) return result;
  const int longest = std::max(raster.values.cols, raster.values.rows);
  if (longest > kLongestSide) return values_at(downsampled(raster, longest / kLongestSide + 1), points, interpolation);
  const bool nearest = interpolation == RasterInterpolation::nearest;
  const double reach = nearest ? 0.5 : 0.0;
  const double x_step = points.x_step_m / raster.resolution_m;
  const double y_step = points.y_step_m / raster.resolution_m;
  const double x = (points.x_m - raster.x_m) / raster.resolution_m;
  const double y = (points.y_m - raster.y_m) / raster.resolution_m;
  const cv::Range columns = indices_within(x, x_step, points.count.width, -reach, raster.values.cols - 1 + reach);
  const cv::Range rows = indices_within(y, y_step, points.count.height, -reach, raster.values.rows - 1 + reach);
  if (columns.empty() || rows.empty()) return result;
  cv::Mat1f inside = result(rows, columns);
  const cv::Matx23d to_node(x_step, 0.0, x + x_step * columns.start, 0.0, y_step, y + y_step * rows.start);
  cv::warpAffine(raster.values, inside, to_node, inside.size(),
                 (nearest ? cv::INTER_NEAREST : cv::INTER_LINEAR) | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return result;
}

cv::Mat1b without_value(const cv::Mat1f& values) {
  cv::Mat1b mask(values.size());
  std::transform(values.begin(), values.end(), mask.begin(),
                 [](float value) { return static_cast<unsigned char>(std::isnan(value) ? 255 : 0); });
  return mask;
}

double mean_height(const Trajectory& drive) {
  double sum = 0.0;
  for (const StampedPose& pose : drive) sum += pose.pose.position.z();
  return drive.empty() ? 0.0 : sum / static_cast<double>(drive.size());
}

double quantile(const cv::Mat1f& values, double share) {
  std::vector<float> known;
  std::copy_if(values.begin(), values.end(), std::back_inserter(known),
               [](float value) { return std::isfinite(value); });
  return known.empty() ? std::numeric_limits<double>::quiet_NaN() : value_at_share(known, share);
}

Scale strength_scale(const cv::Mat1f& values_ut) {
  const Scale scale{quantile(values_ut, 0.01), quantile(values_ut, 0.99)};
  if (!std::isfinite(scale.low)) return {0.0, 1.0};
  return scale.high - scale.low < 0.1 ? Scale{scale.low - 0.05, scale.high + 0.05} : scale;
}

}  // namespace lodestone
