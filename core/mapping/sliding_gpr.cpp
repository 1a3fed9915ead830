#include "core/mapping/sliding_gpr.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/mapping/gpr_sweep.h"

namespace lodestone {
namespace {

GaussianProcessData gather(const std::vector<FieldCell>& cells, const std::vector<int>& chosen, const Vector3& centre) {
  const auto size = static_cast<Eigen::Index>(chosen.size());
  GaussianProcessData data{Eigen::ArrayX3d(size, 3), Eigen::VectorXd(size), Eigen::VectorXd(size)};
  for (Eigen::Index i = 0; i < size; ++i) {
    const FieldCell& cell = cells[chosen[i]];
    data.positions.row(i) = (cell.position - centre).transpose().array();
    data.variance[i] = cell.variance_ut2;
  }
  return data;
}

}  // namespace

SlidingGpr::SlidingGpr(std::vector<FieldCell> cells, const FieldKernels& kernels, const SlidingGprOptions& options)
    : cells_(std::move(cells)), kernels_(kernels), options_(options) {
  if (cells_.empty()) throw std::invalid_argument("sliding-window regression needs a training cell");
  double shortest = kernels_[0].length_scale_m;
  double longest = shortest;
  for (const KernelParameters& kernel : kernels_) {
    shortest = std::min(shortest, kernel.length_scale_m);
    longest = std::max(longest, kernel.length_scale_m);
  }
  stride_ = options_.window_length_scales * shortest;
  reach_ = options_.reach_length_scales * shortest;
  margin_ = std::max(options_.margin_length_scales * longest, reach_);

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
bool SlidingGpr::any_in_box(double min_x, double min_y, double max_x, double max_y, Visit&& visit) const {
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

bool SlidingGpr::supports(const Vector3& point) const {
  return any_in_box(point.x() - reach_, point.y() - reach_, point.x() + reach_, point.y() + reach_, [&](int cell) {
    return (cells_[cell].position - point).head<2>().squaredNorm() <= reach_ * reach_;
  });
}

std::vector<int> SlidingGpr::training_cells(double centre_x, double centre_y) const {
  // Nearest to the window's support first, so that a full window gives up its margin's far edge and nothing else.
  const double half = stride_ + margin_;
  std::vector<std::pair<double, int>> candidates;
  any_in_box(centre_x - half, centre_y - half, centre_x + half, centre_y + half, [&](int cell) {
    const double distance = std::max(std::abs(cells_[cell].position.x() - centre_x),
                                     std::abs(cells_[cell].position.y() - centre_y));
    if (distance <= half) candidates.emplace_back(distance, cell);
    return false;
  });
  const std::size_t count = std::min(candidates.size(), static_cast<std::size_t>(options_.window_points));
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count), candidates.end());
  std::vector<int> chosen;
  chosen.reserve(count);
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(candidates[i].second);
  return chosen;
}

SlidingGpr::WindowPrediction SlidingGpr::solve_window(std::int64_t row, std::int64_t column,
                                                      const std::vector<Vector3>& points) const {
  const Vector3 centre(origin_x() + stride_ * static_cast<double>(column), origin_y() + stride_ * static_cast<double>(row), 0.0);
  const std::vector<int> chosen = training_cells(centre.x(), centre.y());
  GaussianProcessData data = gather(cells_, chosen, centre);
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::ArrayX3d targets(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    targets.row(i) = (points[static_cast<std::size_t>(i)] - centre).transpose().array();
  }
  WindowPrediction result{Eigen::MatrixX3d(count, 3), Eigen::MatrixX3d(count, 3)};
  Eigen::VectorXd mean;
  Eigen::VectorXd variance;
  for (int component = 0; component < 3; ++component) {
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      data.values[static_cast<Eigen::Index>(i)] = cells_[chosen[i]].field_ut[component];
    }
    const GaussianProcess process(data, kernels_[component]);
    process.predict(targets, mean, variance);
    const double prior = options_.scale_prior_points;
    const double scale =
        std::max(1.0, (prior + process.squared_mahalanobis()) / (prior + static_cast<double>(chosen.size())));
    result.mean.col(component) = mean;
    result.variance.col(component) = scale * variance;
  }
  return result;
}

std::vector<FieldPrediction> SlidingGpr::predict(const std::vector<Vector3>& points) const {
  std::vector<char> supported(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(),
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
