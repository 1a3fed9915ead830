#include "core/mapping/windowed_regression.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/error.h"
#include "core/mapping/gpr_sweep.h"
#include "core/parallel.h"

namespace lodestone {

void SlidingGprOptions::check() const {
  const auto require = [](bool good, const char* message) {
    if (!good) throw InputError(std::string("magnetic map: ") + message);
  };
  require(window_points >= 20 && window_points <= 5000, "window_points must be in 20..5000");
  require(window_length_scales > 0.1 && window_length_scales <= 20.0, "window_length_scales must be in 0.1..20");
  require(margin_length_scales >= 0.0, "margin_length_scales must not be negative");
  require(reach_length_scales > 0.0 && reach_length_scales <= 10.0, "reach_length_scales must be in 0..10");
  require(cells_per_length_scale >= 1.0, "cells_per_length_scale must be at least 1");
  require(fit_windows >= 1 && fit_windows <= 1000, "fit_windows must be in 1..1000");
  require(fit_points >= 10 && fit_points <= 5000, "fit_points must be in 10..5000");
  require(calibration_block_m == 0.0 || calibration_block_m >= 0.1, "calibration_block_m must be 0 or at least 0.1");
  require(scale_prior_points > 0.0, "scale_prior_points must be positive");
  require(domain_margin_length_scales > 0.0 && domain_margin_length_scales <= 10.0,
          "domain_margin_length_scales must be in 0..10");
  require(basis_cutoff >= 2.0 && basis_cutoff <= 10.0, "basis_cutoff must be in 2..10");
}

WindowedRegression::WindowedRegression(std::vector<FieldCell> cells, double shortest_length_scale_m,
                                       double longest_length_scale_m, const SlidingGprOptions& options)
    : cells_(std::move(cells)), options_(options) {
  if (cells_.empty()) throw std::invalid_argument("sliding-window regression: expected at least one training cell");
  stride_ = options_.window_length_scales * shortest_length_scale_m;
  reach_ = options_.reach_length_scales * shortest_length_scale_m;
  margin_ = std::max(options_.margin_length_scales * longest_length_scale_m, reach_);

  min_x_ = cells_.front().position.x();
  min_y_ = cells_.front().position.y();
  double max_x = min_x_;
  double max_y = min_y_;
  for (const FieldCell& cell : cells_) {
    min_x_ = std::min(min_x_, cell.position.x());
    min_y_ = std::min(min_y_, cell.position.y());
    max_x = std::max(max_x, cell.position.x());
    max_y = std::max(max_y, cell.position.y());
  }
  bucket_columns_ = static_cast<int>((max_x - min_x_) / stride_) + 1;
  bucket_rows_ = static_cast<int>((max_y - min_y_) / stride_) + 1;
  const auto bucket_of = [&](const FieldCell& cell) {
    const int column = static_cast<int>((cell.position.x() - min_x_) / stride_);
    const int row = static_cast<int>((cell.position.y() - min_y_) / stride_);
    return static_cast<std::size_t>(row) * bucket_columns_ + column;
  };
  bucket_begin_.assign(static_cast<std::size_t>(bucket_columns_) * bucket_rows_ + 1, 0);
  for (const FieldCell& cell : cells_) ++bucket_begin_[bucket_of(cell) + 1];
  for (std::size_t i = 1; i < bucket_begin_.size(); ++i) bucket_begin_[i] += bucket_begin_[i - 1];
  std::vector<int> next(bucket_begin_.begin(), bucket_begin_.end() - 1);
  bucket_cells_.resize(cells_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i) bucket_cells_[next[bucket_of(cells_[i])]++] = static_cast<int>(i);
}

template <class Visit>
bool WindowedRegression::any_in_box(double min_x, double min_y, double max_x, double max_y, Visit&& visit) const {
  const auto bucket = [&](double coordinate, double origin, int count) {
    return static_cast<int>(std::clamp(std::floor((coordinate - origin) / stride_), -1.0, static_cast<double>(count)));
  };
  const int first_column = std::max(bucket(min_x, min_x_, bucket_columns_), 0);
  const int last_column = std::min(bucket(max_x, min_x_, bucket_columns_), bucket_columns_ - 1);
  const int first_row = std::max(bucket(min_y, min_y_, bucket_rows_), 0);
  const int last_row = std::min(bucket(max_y, min_y_, bucket_rows_), bucket_rows_ - 1);
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      const std::size_t index = static_cast<std::size_t>(row) * bucket_columns_ + column;
      for (int i = bucket_begin_[index]; i < bucket_begin_[index + 1]; ++i) {
        if (visit(bucket_cells_[i])) return true;
      }
    }
  }
  return false;
}

bool WindowedRegression::supports(const Vector3& point) const {
  return any_in_box(point.x() - reach_, point.y() - reach_, point.x() + reach_, point.y() + reach_, [&](int cell) {
    return (cells_[cell].position - point).head<2>().squaredNorm() <= reach_ * reach_;
  });
}

std::vector<int> WindowedRegression::training_cells(const Vector3& centre, std::size_t most) const {
  // Nearest to the window's support first. If the window is full, only the margin's far edge is dropped.
  const double half = training_half_side_m();
  std::vector<std::pair<double, int>> candidates;
  any_in_box(centre.x() - half, centre.y() - half, centre.x() + half, centre.y() + half, [&](int cell) {
    const double distance =
        std::max(std::abs(cells_[cell].position.x() - centre.x()), std::abs(cells_[cell].position.y() - centre.y()));
    if (distance <= half) candidates.emplace_back(distance, cell);
    return false;
  });
  const std::size_t count = std::min(candidates.size(), most);
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count), candidates.end());
  std::vector<int> chosen;
  chosen.reserve(count);
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(candidates[i].second);
  return chosen;
}

Vector3 WindowedRegression::window_centre(std::int64_t row, std::int64_t column) const {
  return {origin_x() + stride_ * static_cast<double>(column), origin_y() + stride_ * static_cast<double>(row), 0.0};
}

double WindowedRegression::variance_scale(double squared_mahalanobis, std::size_t values) const {
  const double prior = options_.scale_prior_points;
  return std::max(1.0, (prior + squared_mahalanobis) / (prior + static_cast<double>(values)));
}

std::vector<FieldPrediction> WindowedRegression::predict(const std::vector<Vector3>& points) const {
  std::vector<char> supported(points.size());
  parallel_for(std::size_t{0}, points.size(),
               [&](std::size_t i) { supported[i] = points[i].allFinite() && supports(points[i]); });
  std::vector<FieldPrediction> predictions(points.size());
  GprSweep sweep(*this, [&](std::int64_t tag, const FieldPrediction& prediction) {
    predictions[static_cast<std::size_t>(tag)] = prediction;
  });
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (supported[i] != 0) sweep.add(points[i], static_cast<std::int64_t>(i));
  }
  sweep.finish();
  return predictions;
}

}  // namespace lodestone
