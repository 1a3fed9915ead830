#include "core/mapping/magnetic_map_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"

namespace lodestone {
namespace {

double component_rms(const Vector3& sigma) { return sigma.norm() / std::sqrt(3.0); }

double signal_sigma(const FieldKernels& kernels) {
  return component_rms({kernels[0].signal_sigma, kernels[1].signal_sigma, kernels[2].signal_sigma});
}

double mean_height(const std::vector<FieldCell>& cells) {
  double sum = 0.0;
  for (const FieldCell& cell : cells) sum += cell.position.z();
  return sum / static_cast<double>(cells.size());
}

FieldGrid grid_over(const std::vector<FieldCell>& cells, double reach, const MagneticMapOptions& options) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const FieldCell& cell : cells) {
    low = low.cwiseMin(cell.position.head<2>());
    high = high.cwiseMax(cell.position.head<2>());
  }
  const Eigen::Array2d first = ((low.array() - reach) / options.resolution_m).floor();
  const Eigen::Array2d count = ((high.array() + reach) / options.resolution_m).ceil() - first + 1.0;
  FieldGrid grid;
  grid.heights_m = options.heights_m.empty() ? std::vector<double>{mean_height(cells)} : options.heights_m;
  if (!(count.prod() * static_cast<double>(grid.heights_m.size()) < 2e8)) {
    throw InputError("magnetic map: the survey spans " + std::to_string((high - low).x()) + " by " +
                     std::to_string((high - low).y()) + " m, too much for nodes every " +
                     std::to_string(options.resolution_m) + " m; check the trajectory or give a larger --resolution");
  }
  grid.resolution_m = options.resolution_m;
  grid.origin = (first * options.resolution_m).matrix();
  grid.columns = std::max(static_cast<int>(count.x()), 2);
  grid.rows = std::max(static_cast<int>(count.y()), 2);
  return grid;
}

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

void MagneticMapOptions::check() const {
  const auto require = [](bool good, const char* message) {
    if (!good) throw InputError(std::string("magnetic map: ") + message);
  };
  require(resolution_m >= 0.005 && resolution_m <= 10.0, "resolution_m must lie in 0.005..10");
  require(max_sigma_ut >= 0.0, "max_sigma_ut must not be negative");
  require(held_out_block_s >= 0.0, "held_out_block_s must not be negative");
  for (std::size_t i = 1; i < heights_m.size(); ++i) require(heights_m[i] > heights_m[i - 1], "heights_m must increase");
  regression.check();
}

MagneticMapResult build_magnetic_map(const std::vector<FieldObservation>& observations,
                                     const MagneticMapOptions& options) {
  options.check();
  const FieldKernelFit fit = fit_field_kernels(observations, options.resolution_m, options.regression);
  const std::vector<FieldCell> cells = thin_survey(observations, fit.cell_m);
  const SlidingGpr regression(cells, fit.kernels, options.regression);
  const FieldGrid grid = grid_over(cells, regression.reach_m(), options);

  std::vector<Vector3> points;
  std::vector<std::size_t> node_of_point;
  std::size_t index = 0;
  for (const double height : grid.heights_m) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column, ++index) {
        const Vector3 point(grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
                            height);
        if (!regression.supports(point)) continue;
        points.push_back(point);
        node_of_point.push_back(index);
      }
    }
  }
  const std::vector<FieldPrediction> predictions = regression.predict(points);

  const double limit = options.max_sigma_ut > 0.0 ? options.max_sigma_ut : 0.5 * signal_sigma(fit.kernels);
  std::vector<Eigen::Vector4f> nodes(index, Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN()));
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double sigma = component_rms(predictions[i].sigma_ut);
    nodes[node_of_point[i]] << predictions[i].field_ut.cast<float>(), static_cast<float>(sigma);
    if (sigma <= limit) sigmas.push_back(sigma);
  }
  MagneticMapResult result{MagneticMap(grid, nodes, limit), fit, cells.size(), sigmas.size(), 0.0, 0.0};
  result.median_sigma_ut = quantile(sigmas, 0.5);
  result.high_sigma_ut = quantile(sigmas, 0.95);
  return result;
}

HeldOutScore score_held_out(const std::vector<FieldObservation>& training,
                            const std::vector<FieldObservation>& held_out, const FieldKernelFit& fit,
                            double max_sigma_ut, const SlidingGprOptions& options) {
  const SlidingGpr regression(thin_survey(training, fit.cell_m), fit.kernels, options);
  const std::vector<FieldCell> cells = thin_survey(held_out, fit.cell_m);
  std::vector<Vector3> points;
  for (const FieldCell& cell : cells) points.push_back(cell.position);
  const std::vector<FieldPrediction> predictions = regression.predict(points);
  HeldOutScore score;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!predictions[i].supported || component_rms(predictions[i].sigma_ut) > max_sigma_ut) {
      ++score.refused;
      continue;
    }
    ++score.cells;
    const Vector3 error = cells[i].field_ut - predictions[i].field_ut;
    Vector3 variance = predictions[i].sigma_ut.cwiseAbs2().array() + cells[i].variance_ut2;
    for (int k = 0; k < 3; ++k) variance[k] += fit.kernels[k].noise_sigma * fit.kernels[k].noise_sigma;
    score.rms_ut += error.cwiseAbs2();
    score.normalized_rms += error.cwiseAbs2().cwiseQuotient(variance);
  }
  const double count = std::max<double>(static_cast<double>(score.cells), 1.0);
  score.rms_ut = (score.rms_ut / count).cwiseSqrt();
  score.normalized_rms = (score.normalized_rms / count).cwiseSqrt();
  return score;
}

}  // namespace lodestone
