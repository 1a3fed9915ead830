#include "tools/map/changed_places.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tools/plotting/plan_raster.h"

namespace lodestone {

namespace {

/// The largest χ² over the layers of a place.
double largest_chi_square(const MagneticDifference& difference, const DifferenceSignificance& significance,
                          const DifferencePiece& piece, int row, int column) {
  double largest = 0.0;
  for (int layer = 0; layer < static_cast<int>(difference.grid.heights_m.size()); ++layer) {
    const Eigen::Vector4f& node = piece.at(layer, row, column);
    if (std::isfinite(node[3])) largest = std::max(largest, significance.chi_square(node));
  }
  return largest;
}

}  // namespace

std::vector<ChangedPlace> changed_places(const MagneticDifference& difference,
                                         const DifferenceSignificance& significance, double threshold_ut,
                                         double level) {
  const PlanRaster change = change_raster(difference);
  if (change.empty()) return {};
  const double pixel_m = change.resolution_m;
  const double critical = significance.critical(level);
  cv::Mat mask = change.values > threshold_ut;
  for (const DifferencePiece& piece : difference.pieces) {
    const Eigen::Vector2d corner = difference.grid.origin + pixel_m * Eigen::Vector2d(piece.column, piece.row);
    const cv::Point offset(static_cast<int>(std::lround((corner.x() - change.x_m) / pixel_m)),
                           static_cast<int>(std::lround((corner.y() - change.y_m) / pixel_m)));
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        auto& pixel = mask.at<unsigned char>(offset + cv::Point(column, row));
        if (pixel != 0 && largest_chi_square(difference, significance, piece, row, column) < critical) pixel = 0;
      }
    }
  }
  cv::Mat1i labels;
  cv::Mat1i statistics;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(mask, labels, statistics, centers);
  std::vector<ChangedPlace> places(static_cast<std::size_t>(count - 1));  // label 0 is the background
  for (int label = 1; label < count; ++label) {
    ChangedPlace& place = places[static_cast<std::size_t>(label - 1)];
    place.center =
        Eigen::Vector2d(change.x_m, change.y_m) + pixel_m * Eigen::Vector2d(centers(label, 0), centers(label, 1));
    place.area_m2 = statistics(label, cv::CC_STAT_AREA) * pixel_m * pixel_m;
  }
  const FieldGrid& grid = difference.grid;
  for (const DifferencePiece& piece : difference.pieces) {
    const Eigen::Vector2d corner = grid.origin + pixel_m * Eigen::Vector2d(piece.column, piece.row);
    const cv::Point offset(static_cast<int>(std::lround((corner.x() - change.x_m) / pixel_m)),
                           static_cast<int>(std::lround((corner.y() - change.y_m) / pixel_m)));
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        const int label = labels(offset + cv::Point(column, row));
        if (label == 0) continue;
        ChangedPlace& place = places[static_cast<std::size_t>(label - 1)];
        const double change_ut = piece.change(row, column);
        place.p_value = std::min(
            place.p_value, significance.p_value(largest_chi_square(difference, significance, piece, row, column)));
        place.mean_ut += change_ut * pixel_m * pixel_m / place.area_m2;
        if (!(change_ut > place.largest_ut)) continue;
        const std::int16_t layer = piece.largest_layer[static_cast<std::size_t>(row) * piece.columns + column];
        place.largest_ut = change_ut;
        place.sigma_ut = piece.at(layer, row, column)[3];
        place.largest_at = {corner.x() + pixel_m * column, corner.y() + pixel_m * row, grid.heights_m[layer]};
      }
    }
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const ChangedPlace& a, const ChangedPlace& b) { return a.largest_ut > b.largest_ut; });
  return places;
}

}  // namespace lodestone
