#include "core/mapping/sliding_gpr.h"

#include <algorithm>

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

double shortest_length_scale(const FieldKernels& kernels) {
  return std::min({kernels[0].length_scale_m, kernels[1].length_scale_m, kernels[2].length_scale_m});
}

double longest_length_scale(const FieldKernels& kernels) {
  return std::max({kernels[0].length_scale_m, kernels[1].length_scale_m, kernels[2].length_scale_m});
}

}  // namespace

SlidingGpr::SlidingGpr(std::vector<FieldCell> cells, const FieldKernels& kernels, const SlidingGprOptions& options)
    : WindowedRegression(std::move(cells), shortest_length_scale(kernels), longest_length_scale(kernels), options),
      kernels_(kernels) {}

WindowedRegression::WindowPrediction SlidingGpr::solve_window(std::int64_t row, std::int64_t column,
                                                              const std::vector<Vector3>& points) const {
  const Vector3 centre = window_centre(row, column);
  const std::vector<int> chosen = training_cells(centre, static_cast<std::size_t>(options().window_points));
  GaussianProcessData data = gather(cells(), chosen, centre);
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
      data.values[static_cast<Eigen::Index>(i)] = cells()[chosen[i]].field_ut[component];
    }
    const GaussianProcess process(data, kernels_[component]);
    process.predict(targets, mean, variance);
    result.mean.col(component) = mean;
    result.variance.col(component) = variance_scale(process.squared_mahalanobis(), chosen.size()) * variance;
  }
  return result;
}

}  // namespace lodestone
