#include "tools/map/changed_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "tools/plotting/plan_raster.h"

namespace lodestone {
namespace {

/// |ΔB| over the stated sigma; infinite if both maps state a sigma of 0.
double stated_sigmas(const Eigen::Vector4f& node) {
  const bool certain = node[3] == 0.0F && node.head<3>().norm() > 0.0F;
  return certain ? std::numeric_limits<double>::infinity() : node[3];
}

/// The largest over the layers at a node of a piece.
double most_stated_sigmas(const DifferencePiece& piece, int layers, int row, int column) {
  double most = 0.0;
  for (int layer = 0; layer < layers; ++layer) {
    const double sigmas = stated_sigmas(piece.at(layer, row, column));
    if (sigmas > most) most = sigmas;  // false for NaN
  }
  return most;
}

}  // namespace

std::vector<ChangedPlace> changed_places(const MagneticDifference& difference,
                                         const DifferenceSignificance& significance, double threshold_ut) {
  const PlanRaster change = change_raster(difference);
  if (change.empty()) return {};
  const double pixel_m = change.resolution_m;
  cv::Mat1i labels;
  cv::Mat1i statistics;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(change.values > threshold_ut, labels, statistics, centers);
  std::vector<ChangedPlace> places(static_cast<std::size_t>(count - 1));  // label 0 is the background
  for (int label = 1; label < count; ++label) {
    ChangedPlace& place = places[static_cast<std::size_t>(label - 1)];
    place.center =
        Eigen::Vector2d(change.x_m, change.y_m) + pixel_m * Eigen::Vector2d(centers(label, 0), centers(label, 1));
    place.area_m2 = statistics(label, cv::CC_STAT_AREA) * pixel_m * pixel_m;
  }
  const FieldGrid& grid = difference.grid;
  const int layers = static_cast<int>(grid.heights_m.size());
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
        place.mean_ut += change_ut * pixel_m * pixel_m / place.area_m2;
        place.most_sigmas = std::max(place.most_sigmas, most_stated_sigmas(piece, layers, row, column));
        if (!(change_ut > place.largest_ut)) continue;
        const std::int16_t layer = piece.largest_layer[static_cast<std::size_t>(row) * piece.columns + column];
        place.largest_ut = change_ut;
        place.sigma_ut = change_ut / stated_sigmas(piece.at(layer, row, column));
        place.largest_at = {corner.x() + pixel_m * column, corner.y() + pixel_m * row, grid.heights_m[layer]};
      }
    }
  }
  for (ChangedPlace& place : places) {
    place.p_value = significance.p_value(place.most_sigmas);
    place.scaled_sigma_ut = place.sigma_ut * significance.sigma_scale();
    place.most_sigmas /= significance.sigma_scale();
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const ChangedPlace& a, const ChangedPlace& b) { return a.largest_ut > b.largest_ut; });
  return places;
}

}  // namespace lodestone
