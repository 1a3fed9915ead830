#include "core/mapping/magnetic_map_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "core/error.h"
#include "core/magnetometer/sparse_field_nodes.h"
#include "core/mapping/gpr_sweep.h"
#include "core/middle_value.h"
#include "core/parallel.h"

namespace lodestone {
namespace {

/// Most points that wait for the regression; some 400 bytes each, and up to a second of work in all.
constexpr std::size_t waiting_points = 5000;
/// Default limit of σ over the signal's: the survey explains half of the signal's variance.
constexpr double kMostOfSignal = 0.7071;
constexpr double kMostNodes = 2e8;
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

/// Sigma of the array's height about `layer_m` over the readings: each magnetometer about its own mean height, and the
/// mean over the magnetometers about the layer.
double height_sigma(const std::vector<FieldObservation>& readings, double layer_m) {
  struct Heights {
    double count = 0.0, sum_m = 0.0, squares_m2 = 0.0;  // above the layer
  };
  std::map<int, Heights> heights;
  for (const FieldObservation& reading : readings) {
    Heights& sums = heights[reading.magnetometer];
    const double above_m = reading.position.z() - layer_m;
    sums.count += 1.0;
    sums.sum_m += above_m;
    sums.squares_m2 += above_m * above_m;
  }
  double mean_m = 0.0, variance_m2 = 0.0;
  for (const auto& [magnetometer, sums] : heights) {
    mean_m += sums.sum_m / sums.count;
    variance_m2 += std::max(0.0, sums.squares_m2 / sums.count - std::pow(sums.sum_m / sums.count, 2));
  }
  const auto count = static_cast<double>(heights.size());
  return std::sqrt(variance_m2 / count + std::pow(mean_m / count, 2));
}

/// Distance over which a component changes with height, the shortest of the three.
double height_length_m(const FieldKernelFit& fit) {
  // A component is a slope of the potential, and the field's slope is sqrt(3) times as steep as the potential's.
  if (fit.potential) return fit.potential->vertical_length_scale_m / std::sqrt(3.0);
  return std::min({fit.kernels[0].length_scale_m, fit.kernels[1].length_scale_m, fit.kernels[2].length_scale_m});
}

/// One layer where the survey keeps its height, as a robot on a floor does. Else layers at most half a length scale
/// apart, between which the field is nearly linear, from below the lowest cell to above the highest.
std::vector<double> layer_heights(const std::vector<FieldCell>& cells, const std::vector<FieldObservation>& readings,
                                  const FieldKernelFit& fit) {
  constexpr double kMostLayers = 40.0;
  const double layer_m = mean_height(cells);
  if (!(height_sigma(readings, layer_m) > most_height_sigma_m(fit))) return {layer_m};
  const auto lower = [](const FieldCell& a, const FieldCell& b) { return a.position.z() < b.position.z(); };
  const auto [low, high] = std::minmax_element(cells.begin(), cells.end(), lower);
  const double range_m = high->position.z() - low->position.z();
  const double steps = std::ceil(range_m / (0.5 * height_length_m(fit)));
  if (steps + 2.0 > kMostLayers) return {layer_m};
  std::vector<double> heights_m;
  for (double step = -0.5; step < steps + 1.0; step += 1.0) {
    heights_m.push_back(1e-3 * std::round(1e3 * (low->position.z() + step * range_m / steps)));
  }
  return heights_m;
}

FieldGrid grid_over(const std::vector<FieldCell>& cells, double reach, const MagneticMapOptions& options,
                    std::vector<double> heights_m) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const FieldCell& cell : cells) {
    low = low.cwiseMin(cell.position.head<2>());
    high = high.cwiseMax(cell.position.head<2>());
  }
  const Eigen::Array2d first = ((low.array() - reach) / options.resolution_m).floor();
  const Eigen::Array2d count = ((high.array() + reach) / options.resolution_m).ceil() - first + 1.0;
  FieldGrid grid;
  const auto too_many = [&](const std::vector<double>& heights) {
    return !(count.prod() * static_cast<double>(heights.size()) < kMostNodes);
  };
  if (options.heights_m.empty() && too_many(heights_m)) heights_m = {mean_height(cells)};
  grid.heights_m = std::move(heights_m);
  if (too_many(grid.heights_m)) {
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

/// Visits the rows of each layer: `visit(layer, row, nodes)` with the row and the rows beside it, NaN beyond the grid.
template <class Visit>
void for_each_row(const SparseFieldNodes& nodes, const FieldGrid& grid, Visit&& visit) {
  using Row = std::vector<Eigen::Vector4f>;
  const auto columns = static_cast<std::size_t>(grid.columns);
  const Eigen::Vector4f missing = Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN());
  for (int layer = 0; layer < static_cast<int>(grid.heights_m.size()); ++layer) {
    std::array<Row, 3> rows{Row(columns, missing), Row(columns, missing), Row(columns, missing)};
    const auto read = [&](int row, Row& into) {
      into.assign(columns, missing);
      if (row < grid.rows) nodes.read(layer, row, 0, 1, grid.columns, into.data());
    };
    read(0, rows[2]);
    for (int row = 0; row < grid.rows; ++row) {
      std::swap(rows[0], rows[1]);
      std::swap(rows[1], rows[2]);
      read(row + 1, rows[2]);
      visit(layer, row, rows);
    }
  }
}

/// Sum of the squared slopes of a node's components along x and y, from the neighbours that exist, (µT/m)².
double squared_slope(const std::array<std::vector<Eigen::Vector4f>, 3>& rows, std::size_t column, double resolution_m) {
  const Eigen::Vector4f missing = Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN());
  const Eigen::Vector4f& here = rows[1][column];
  const auto along = [&](const Eigen::Vector4f& before, const Eigen::Vector4f& after) {
    const bool left = std::isfinite(before[3]);
    const bool right = std::isfinite(after[3]);
    if (!left && !right) return 0.0;
    const Eigen::Vector3f change = (right ? after : here).head<3>() - (left ? before : here).head<3>();
    return change.cast<double>().squaredNorm() / std::pow(resolution_m * (left && right ? 2.0 : 1.0), 2);
  };
  return along(column > 0 ? rows[1][column - 1] : missing,
               column + 1 < rows[1].size() ? rows[1][column + 1] : missing) +
         along(rows[0][column], rows[2][column]);
}

/// Adds the variance position_sigma_m² |∇B|² / 3 to the nodes.
std::shared_ptr<SparseFieldNodes> with_position_error(const SparseFieldNodes& nodes, const FieldGrid& grid,
                                                      double position_sigma_m) {
  auto result = std::make_shared<SparseFieldNodes>();
  for_each_row(nodes, grid, [&](int layer, int row, const std::array<std::vector<Eigen::Vector4f>, 3>& rows) {
    for (std::size_t column = 0; column < rows[1].size(); ++column) {
      Eigen::Vector4f node = rows[1][column];
      if (!std::isfinite(node[3])) continue;
      const double squares = squared_slope(rows, column, grid.resolution_m);
      node[3] =
          static_cast<float>(std::sqrt(std::pow(node[3], 2) + position_sigma_m * position_sigma_m * squares / 3.0));
      result->set(layer, row, static_cast<int>(column), node);
    }
  });
  return result;
}

/// A clock's offset below this many sigmas is not looked at.
constexpr double kLeastClockSigmas = 3.0;

struct FittedSurvey {
  SurveyErrors errors;
  FieldKernelFit fit;
};

/// Kernels of the readings without the errors of the magnetometers, their offsets and that of their clock, or one of
/// the two, or none: what predicts held-out readings better than no correction, in this order.
FittedSurvey fit_survey(const std::vector<FieldObservation>& readings, const MagneticMapOptions& options,
                        const MapProgress& progress) {
  const auto fit = [&](const std::vector<FieldObservation>& observations) {
    if (progress) progress(0.0);
    return fit_field_kernels(observations, options.resolution_m, options.regression, options.method);
  };
  SurveyErrors found = survey_errors(readings, {options.offset_sigma_ut, options.clock_sigma_s});
  if (options.clock_sigma_s > 0.0 && std::abs(found.clock_s) <= kLeastClockSigmas * found.clock_sigma_s)
    found = survey_errors(readings, {options.offset_sigma_ut, 0.0});
  std::vector<SurveyErrors> candidates;
  const bool has_offsets = mean_square_offset(found.offsets_ut) > 0.0;
  if (has_offsets) candidates.push_back(found);
  if (has_offsets && found.clock_s != 0.0) candidates.push_back({found.offsets_ut});
  if (found.clock_s != 0.0) candidates.push_back({{}, found.clock_s, found.clock_sigma_s});
  const FittedSurvey plain{{}, fit(readings)};
  for (const SurveyErrors& errors : candidates) {
    const FittedSurvey corrected{errors, fit(without_errors(readings, errors))};
    if (corrected.fit.drive.held_out_cost < plain.fit.drive.held_out_cost) return corrected;
  }
  return plain;
}

std::vector<double> sigmas_within(const SparseFieldNodes& nodes, const FieldGrid& grid, double limit) {
  std::vector<double> sigmas;
  for_each_row(nodes, grid, [&](int, int, const std::array<std::vector<Eigen::Vector4f>, 3>& rows) {
    for (const Eigen::Vector4f& node : rows[1]) {
      if (node[3] <= limit) sigmas.push_back(node[3]);
    }
  });
  return sigmas;
}

}  // namespace

void MagneticMapOptions::check() const {
  const auto require = [](bool good, const char* message) {
    if (!good) throw InputError(std::string("magnetic map: ") + message);
  };
  require(resolution_m >= 0.005 && resolution_m <= 10.0, "resolution_m must be in 0.005..10");
  require(max_sigma_ut >= 0.0, "max_sigma_ut must not be negative");
  require(offset_sigma_ut >= 0.0 && offset_sigma_ut <= 1000.0, "offset_sigma_ut must be in 0..1000");
  require(clock_sigma_s >= 0.0 && clock_sigma_s <= 1.0, "clock_sigma_s must be in 0..1");
  require(tile_m > 0.0 && tile_m <= 1000.0, "tile_m must be in 0..1000");
  require(held_out_block_m == 0.0 || held_out_block_m >= 0.1, "held_out_block_m must be 0 or at least 0.1");
  for (std::size_t i = 1; i < heights_m.size(); ++i)
    require(heights_m[i] > heights_m[i - 1], "heights_m must increase");
  regression.check();
}

int MagneticMapOptions::tile_nodes() const {
  return std::clamp(static_cast<int>(std::lround(tile_m / resolution_m / 16.0)), 1, 64) * 16;
}

double most_height_sigma_m(const FieldKernelFit& fit) {
  constexpr double kOfARobotOnAFloor_m = 0.1;
  return std::max(kOfARobotOnAFloor_m, 0.25 * height_length_m(fit));
}

MagneticMapResult build_magnetic_map(const std::vector<FieldObservation>& readings, const MagneticMapOptions& options,
                                     const MapProgress& progress) {
  options.check();
  const auto [found, fit] = fit_survey(readings, options, progress);
  const std::vector<FieldCell> cells = thin_survey(without_errors(readings, found), fit.cell_m);
  const std::unique_ptr<const WindowedRegression> regression = make_regression(cells, fit, options.regression);
  const FieldGrid grid = grid_over(cells, regression->reach_m(), options,
                                   options.heights_m.empty() ? layer_heights(cells, readings, fit) : options.heights_m);

  // Row by row from below: then memory contains only a few rows of the regression's windows.
  // The next drive has offsets of this size, too. They do not make a node's field less known.
  const double offset_variance = mean_square_offset(found.offsets_ut);
  const Vector3 drive_variance = fit.drive.sigma_ut.cwiseAbs2().array() + offset_variance;
  const double limit = options.max_sigma_ut > 0.0
                           ? options.max_sigma_ut
                           : std::hypot(kMostOfSignal * signal_sigma(fit.kernels), std::sqrt(offset_variance));
  auto nodes = std::make_shared<SparseFieldNodes>();
  const auto layers = static_cast<int>(grid.heights_m.size());
  GprSweep sweep(*regression, [&](std::int64_t tag, const FieldPrediction& prediction) {
    // The error of a drive is correlated over a stretch of its way, so neither the map nor a later drive averages it
    // out.
    const double sigma = component_rms((prediction.sigma_ut.cwiseAbs2() + drive_variance).cwiseSqrt());
    Eigen::Vector4f node;
    node << prediction.field_ut.cast<float>(), static_cast<float>(sigma);
    const std::int64_t row = tag / grid.columns;
    nodes->set(static_cast<int>(row / grid.rows), static_cast<int>(row % grid.rows),
               static_cast<int>(tag % grid.columns), node);
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
    if (progress) progress((row + 1.0) / grid.rows);
  }
  sweep.finish();
  if (fit.drive.position_sigma_m > 0.0) nodes = with_position_error(*nodes, grid, fit.drive.position_sigma_m);
  FieldMapErrors errors{fit.drive.correlation_m, fit.drive.sigma_shares};
  if (layers == 1) errors.height_sigma_m = height_sigma(readings, grid.heights_m.front());
  std::vector<double> sigmas = sigmas_within(*nodes, grid, limit);
  MagneticMapResult result{
      MagneticMap(grid, nodes, limit, cache_bytes, errors), fit, cells.size(), sigmas.size(), 0.0, 0.0, found};
  const auto at = [&](double share) {
    return sigmas.empty() ? std::numeric_limits<double>::quiet_NaN() : value_at_share(sigmas, share);
  };
  result.median_sigma_ut = at(0.5);
  result.high_sigma_ut = at(0.95);
  return result;
}

HeldOutScore score_held_out(const SurveySplit& split, const FieldKernelFit& fit, double max_sigma_ut,
                            const SlidingGprOptions& options) {
  const std::vector<FieldCell>& cells = split.held_out;
  std::vector<Vector3> points;
  points.reserve(cells.size());
  for (const FieldCell& cell : cells) points.push_back(cell.position);
  const std::vector<SlopedPrediction> predictions =
      predict_with_slopes(*make_regression(split.training, fit, options), points, 0.5 * fit.cell_m);
  HeldOutScore score;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const FieldPrediction& field = predictions[i].field;
    const Vector3 drive = fit.drive.variance(predictions[i].squared_slope);
    if (!field.supported || component_rms((field.sigma_ut.cwiseAbs2() + drive).cwiseSqrt()) > max_sigma_ut) {
      ++score.refused;
      continue;
    }
    ++score.cells;
    const Vector3 error = cells[i].field_ut - field.field_ut;
    // Without a drive error, the cell's own error is the noise of the likelihood fit.
    const Vector3 own = drive.cwiseMax(fit.uncalibrated_noise.cwiseAbs2());
    const Vector3 variance = (field.sigma_ut.cwiseAbs2() + own).array() + cells[i].variance_ut2;
    score.rms_ut += error.cwiseAbs2();
    score.normalized_rms += error.cwiseAbs2().cwiseQuotient(variance);
  }
  const double count = std::max<double>(static_cast<double>(score.cells), 1.0);
  score.rms_ut = (score.rms_ut / count).cwiseSqrt();
  score.normalized_rms = (score.normalized_rms / count).cwiseSqrt();
  return score;
}

std::optional<HeldOutScore> score_held_out_blocks(const std::vector<FieldObservation>& readings,
                                                  const MagneticMapResult& result, const MagneticMapOptions& options) {
  if (options.held_out_block_m <= 0.0) return std::nullopt;
  const std::vector<FieldObservation> observations = without_errors(readings, result.errors);
  const SurveySplit split =
      split_survey(observations, result.fit.cell_m, HeldOutBlocks(observations, options.held_out_block_m, 10, 5));
  if (split.held_out.empty() || split.training.empty()) return std::nullopt;
  // The sigma of a node contains the offsets, that of a prediction does not.
  const double limit = result.map.max_sigma_ut();
  const double without_offsets = std::sqrt(std::max(limit * limit - mean_square_offset(result.errors.offsets_ut), 0.0));
  return score_held_out(split, result.fit, without_offsets, options.regression);
}

}  // namespace lodestone
