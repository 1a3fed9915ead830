#include "core/mapping/magnetic_map_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "core/error.h"
#include "core/magnetometer/sparse_field_nodes.h"
#include "core/mapping/gpr_sweep.h"
#include "core/parallel.h"

namespace lodestone {
namespace {

/// Most points that wait for the regression; some 400 bytes each.
constexpr std::size_t waiting_points = 20000;
/// Cache for tiles of the finished map.
constexpr std::size_t cache_bytes = 16U << 20U;

double component_rms(const Vector3& sigma) {
  return sigma.norm() / std::sqrt(3.0);
}

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
                     std::to_string((high - low).y()) + " m; the map would be too large for nodes every " +
                     std::to_string(options.resolution_m) + " m. Check the trajectory or set a larger --resolution");
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
  require(resolution_m >= 0.005 && resolution_m <= 10.0, "resolution_m must be in 0.005..10");
  require(max_sigma_ut >= 0.0, "max_sigma_ut must not be negative");
  require(tile_m > 0.0 && tile_m <= 1000.0, "tile_m must be in 0..1000");
  require(held_out_block_s >= 0.0, "held_out_block_s must not be negative");
  for (std::size_t i = 1; i < heights_m.size(); ++i)
    require(heights_m[i] > heights_m[i - 1], "heights_m must increase");
  regression.check();
}

int MagneticMapOptions::tile_nodes() const {
  return std::clamp(static_cast<int>(std::lround(tile_m / resolution_m / 16.0)), 1, 64) * 16;
}

MagneticMapResult build_magnetic_map(const std::vector<FieldObservation>& observations,
                                     const MagneticMapOptions& options) {
  options.check();
  const FieldKernelFit fit = fit_field_kernels(observations, options.resolution_m, options.regression, options.method);
  const std::vector<FieldCell> cells = thin_survey(observations, fit.cell_m);
  const std::unique_ptr<const WindowedRegression> regression = make_regression(cells, fit, options.regression);
  const FieldGrid grid = grid_over(cells, regression->reach_m(), options);

  // Row by row from below: then memory contains only a few rows of the regression's windows.
  const double limit = options.max_sigma_ut > 0.0 ? options.max_sigma_ut : 0.5 * signal_sigma(fit.kernels);
  const auto nodes = std::make_shared<SparseFieldNodes>();
  std::vector<double> sigmas;
  const auto layers = static_cast<int>(grid.heights_m.size());
  GprSweep sweep(*regression, [&](std::int64_t tag, const FieldPrediction& prediction) {
    const double sigma = component_rms(prediction.sigma_ut);
    Eigen::Vector4f node;
    node << prediction.field_ut.cast<float>(), static_cast<float>(sigma);
    const std::int64_t row = tag / grid.columns;
    nodes->set(static_cast<int>(row / grid.rows), static_cast<int>(row % grid.rows),
               static_cast<int>(tag % grid.columns), node);
    if (sigma <= limit) sigmas.push_back(sigma);
  });
  std::vector<char> supported(static_cast<std::size_t>(grid.columns));
  for (int row = 0; row < grid.rows; ++row) {
    const double y = grid.origin.y() + grid.resolution_m * row;
    if (sweep.waiting() > waiting_points) sweep.complete_below(y);
    const auto place = [&](int column) { return Vector3(grid.origin.x() + grid.resolution_m * column, y, 0.0); };
    parallel_for(0, grid.columns, [&](int column) { supported[column] = regression->supports(place(column)); });
    for (int layer = 0; layer < layers; ++layer) {
      for (int column = 0; column < grid.columns; ++column) {
        if (supported[column] == 0) continue;
        const std::int64_t tag = (static_cast<std::int64_t>(layer) * grid.rows + row) * grid.columns + column;
        sweep.add({place(column).x(), y, grid.heights_m[layer]}, tag);
      }
    }
  }
  sweep.finish();
  MagneticMapResult result{MagneticMap(grid, nodes, limit, cache_bytes), fit, cells.size(), sigmas.size(), 0.0, 0.0};
  result.median_sigma_ut = quantile(sigmas, 0.5);
  result.high_sigma_ut = quantile(sigmas, 0.95);
  return result;
}

HeldOutScore score_held_out(const SurveySplit& split, const FieldKernelFit& fit, double max_sigma_ut,
                            const SlidingGprOptions& options) {
  const std::vector<FieldCell>& cells = split.held_out;
  std::vector<Vector3> points;
  for (const FieldCell& cell : cells) points.push_back(cell.position);
  const std::vector<FieldPrediction> predictions = make_regression(split.training, fit, options)->predict(points);
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
