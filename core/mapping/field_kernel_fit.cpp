#include "core/mapping/field_kernel_fit.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "core/error.h"
#include "core/mapping/curl_free_regression.h"
#include "core/mapping/kernel_fit.h"
#include "core/mapping/noise_calibration.h"

namespace lodestone {
namespace {

/// The `count` cells nearest to `centre` in the x-y plane.
std::vector<int> nearest_cells(const std::vector<FieldCell>& cells, const Vector3& centre, std::size_t count) {
  std::vector<std::pair<double, int>> distances(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    distances[i] = {(cells[i].position - centre).head<2>().squaredNorm(), static_cast<int>(i)};
  }
  count = std::min(count, cells.size());
  std::partial_sort(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(count), distances.end());
  std::vector<int> chosen(count);
  for (std::size_t i = 0; i < count; ++i) chosen[i] = distances[i].second;
  return chosen;
}

/// Data sets of one component, with the first cell as the origin of each set.
std::vector<GaussianProcessData> component_sets(const std::vector<FieldCell>& cells,
                                                const std::vector<std::vector<int>>& windows, int component) {
  std::vector<GaussianProcessData> sets;
  for (const std::vector<int>& window : windows) {
    const auto size = static_cast<Eigen::Index>(window.size());
    GaussianProcessData set{Eigen::ArrayX3d(size, 3), Eigen::VectorXd(size), Eigen::VectorXd(size)};
    for (Eigen::Index i = 0; i < size; ++i) {
      const FieldCell& cell = cells[window[i]];
      set.positions.row(i) = (cell.position - cells[window[0]].position).transpose().array();
      set.values[i] = cell.field_ut[component];
      set.variance[i] = cell.variance_ut2;
    }
    sets.push_back(std::move(set));
  }
  return sets;
}

KernelParameters first_guess(const std::vector<FieldCell>& cells, int component, double cell_m) {
  double sum = 0.0;
  double squares = 0.0;
  for (const FieldCell& cell : cells) sum += cell.field_ut[component];
  const double mean = sum / static_cast<double>(cells.size());
  for (const FieldCell& cell : cells) squares += std::pow(cell.field_ut[component] - mean, 2);
  const double spread = std::max(std::sqrt(squares / static_cast<double>(cells.size())), 0.1);
  KernelParameters guess;
  guess.mean = mean;
  guess.mean_sigma = 3.0 * spread;  // distant windows have different means
  guess.signal_sigma = spread;
  guess.length_scale_m = std::max(0.4, 3.0 * cell_m);
  guess.noise_sigma = 0.1 * spread;
  return guess;
}

void fit_components(const std::vector<FieldCell>& cells, const std::vector<std::vector<int>>& windows, int round,
                    FieldKernelFit& result) {
  for (int component = 0; component < 3; ++component) {
    KernelParameters start = first_guess(cells, component, result.cell_m);
    KernelBounds bounds;
    bounds.min_length_scale_m = result.cell_m;
    if (round > 0) start.length_scale_m = result.kernels[component].length_scale_m;
    const KernelFit fit = fit_kernel(component_sets(cells, windows, component), start, bounds);
    result.kernels[component] = fit.parameters;
    result.evaluations += fit.evaluations;
  }
}

FieldKernels component_kernels(const CurlFreeKernel& potential) {
  FieldKernels kernels;
  for (int k = 0; k < 3; ++k) {
    kernels[k] = {potential.mean_ut[k], potential.linear_sigma_ut, potential.signal_sigmas_ut()[k],
                  potential.length_scale_m, potential.noise_sigma_ut};
  }
  return kernels;
}

void fit_potential(const std::vector<FieldCell>& cells, const std::vector<std::vector<int>>& windows, int round,
                   FieldKernelFit& result) {
  // A cell has three values, and the likelihood is cubic in their number. Every other cell of a window is used, so that
  // the set spans the same area.
  std::vector<std::vector<FieldCell>> sets;
  for (const std::vector<int>& window : windows) {
    std::vector<FieldCell>& set = sets.emplace_back();
    for (std::size_t i = 0; i < window.size(); i += 2) set.push_back(cells[window[i]]);
  }
  CurlFreeKernel start;
  Vector3 spread;
  for (int k = 0; k < 3; ++k) {
    const KernelParameters guess = first_guess(cells, k, result.cell_m);
    start.mean_ut[k] = guess.mean;
    spread[k] = guess.signal_sigma;
    start.length_scale_m = start.vertical_length_scale_m = 1.5 * guess.length_scale_m;
  }
  start.signal_sigma_ut = start.linear_sigma_ut = spread.norm() / std::sqrt(3.0);
  start.noise_sigma_ut = 0.1 * start.signal_sigma_ut;
  if (round > 0) {
    start.length_scale_m = result.potential->length_scale_m;
    start.vertical_length_scale_m = result.potential->vertical_length_scale_m;
  }
  KernelBounds bounds;
  bounds.min_length_scale_m = result.cell_m;
  const CurlFreeFit fit = fit_curl_free_kernel(sets, start, bounds);
  result.potential = fit.kernel;
  result.kernels = component_kernels(fit.kernel);
  result.evaluations += fit.evaluations;
}

/// Length scale that determines the thinning: along its own axis, a component of a gradient changes √3 times faster
/// than its potential.
double shortest_structure(const FieldKernelFit& fit) {
  if (fit.potential) return fit.potential->length_scale_m / std::sqrt(3.0);
  return std::min({fit.kernels[0].length_scale_m, fit.kernels[1].length_scale_m, fit.kernels[2].length_scale_m});
}

constexpr double well_known = 0.35;  // of the signal's sigma

/// Errors of those held-out cells, of one component, that the survey predicts well without them: cells near another
/// pass.
void gather_errors(const std::vector<FieldCell>& held_out, const std::vector<FieldPrediction>& predictions,
                   int component, double signal_sigma, std::vector<HeldOutError>& errors) {
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    const double sigma = predictions[i].sigma_ut[component];
    if (!predictions[i].supported || sigma > well_known * signal_sigma) continue;
    errors.push_back({std::pow(held_out[i].field_ut[component] - predictions[i].field_ut[component], 2),
                      sigma * sigma + held_out[i].variance_ut2});
  }
}

/// Raises `noise_sigma` if the held-out errors require it.
bool raise_noise(const std::vector<HeldOutError>& errors, std::size_t enough, double& noise_sigma) {
  if (errors.size() < enough) return false;
  const double noise = noise_sigma * noise_sigma;
  const double calibrated = calibrated_noise(errors, noise);
  noise_sigma = std::sqrt(calibrated);
  return calibrated > noise;
}

/// The drive error of the held-out cells, after calibration of the noise.
DriveError drive_error(const std::vector<CalibrationSplit>& splits, const FieldKernelFit& fit,
                       const SlidingGprOptions& options) {
  std::vector<HeldOutCell> cells;
  for (const auto& [split, blocks] : splits) {
    std::vector<Vector3> points;
    for (const FieldCell& cell : split.held_out) points.push_back(cell.position);
    const std::vector<SlopedPrediction> predictions =
        predict_with_slopes(*make_regression(split.training, fit, options), points, 0.5 * fit.cell_m);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FieldPrediction& field = predictions[i].field;
      if (!field.supported) continue;
      HeldOutCell& cell = cells.emplace_back();
      cell.position = points[i];
      cell.block = blocks[i];
      cell.error_ut = split.held_out[i].field_ut - field.field_ut;
      cell.variance_ut2 = field.sigma_ut.cwiseAbs2().array() + split.held_out[i].variance_ut2;
      cell.squared_slope = predictions[i].squared_slope;
      for (int k = 0; k < 3; ++k) {
        cell.well_predicted[static_cast<std::size_t>(k)] =
            field.sigma_ut[k] <= well_known * fit.kernels[k].signal_sigma;
      }
    }
  }
  return fit_drive_error(cells, 0.25 * options.calibration_block_m);
}

void calibrate_noise(const std::vector<FieldObservation>& observations, const SlidingGprOptions& options,
                     FieldKernelFit& fit) {
  const std::vector<CalibrationSplit> splits =
      splits_for_calibration(observations, fit.cell_m, options.calibration_block_m);
  std::size_t cells = 0;
  for (const auto& [split, blocks] : splits) {
    cells += split.held_out.size();
    if (split.training.size() < enough_held_out_cells) return;
  }
  if (cells < enough_held_out_cells) return;
  std::vector<std::vector<FieldPrediction>> predictions(splits.size());
  for (int round = 0; round < 4; ++round) {  // the prediction also depends on the noise
    for (std::size_t s = 0; s < splits.size(); ++s) {
      std::vector<Vector3> points;
      for (const FieldCell& cell : splits[s].cells.held_out) points.push_back(cell.position);
      predictions[s] = make_regression(splits[s].cells.training, fit, options)->predict(points);
    }
    bool changed = false;
    std::vector<HeldOutError> errors;
    for (int component = 0; component < 3; ++component) {
      KernelParameters& kernel = fit.kernels[component];
      if (!fit.potential) errors.clear();
      for (std::size_t s = 0; s < splits.size(); ++s) {
        gather_errors(splits[s].cells.held_out, predictions[s], component, kernel.signal_sigma, errors);
      }
      if (!fit.potential) changed = raise_noise(errors, enough_held_out_cells, kernel.noise_sigma) || changed;
    }
    if (fit.potential) {  // one noise for all components
      changed = raise_noise(errors, 3 * enough_held_out_cells, fit.potential->noise_sigma_ut);
      fit.kernels = component_kernels(*fit.potential);
    }
    if (!changed) break;
  }
  fit.drive = drive_error(splits, fit, options);
}

}  // namespace

FieldKernelFit fit_field_kernels(const std::vector<FieldObservation>& observations, double finest_cell_m,
                                 const SlidingGprOptions& options, FieldMethod method) {
  FieldKernelFit result;
  result.cell_m = finest_cell_m;
  for (int round = 0; round < 4; ++round) {
    const std::vector<FieldCell> cells = thin_survey(observations, result.cell_m);
    if (cells.size() < 10) {
      throw InputError("magnetic map: the survey covers " + std::to_string(cells.size()) + " cells of " +
                       std::to_string(result.cell_m) + " m; at least 10 are needed. Survey a longer path");
    }
    std::mt19937_64 generator(static_cast<std::uint64_t>(options.seed));
    std::vector<std::vector<int>> windows;
    const auto size = static_cast<std::size_t>(options.fit_points);
    const std::size_t count = cells.size() <= size ? 1 : static_cast<std::size_t>(options.fit_windows);
    for (std::size_t i = 0; i < count; ++i) {
      windows.push_back(nearest_cells(cells, cells[generator() % cells.size()].position, size));
    }
    (method == FieldMethod::curl_free ? fit_potential : fit_components)(cells, windows, round, result);
    result.windows = static_cast<int>(count);
    // A smooth field needs fewer cells. The windows of the fit must span several length scales to determine the length
    // scale.
    const double wanted = shortest_structure(result) / options.cells_per_length_scale;
    if (wanted < 1.3 * result.cell_m) break;
    result.cell_m = wanted;
  }
  for (int k = 0; k < 3; ++k) result.uncalibrated_noise[k] = result.kernels[k].noise_sigma;
  if (options.calibration_block_m > 0.0) calibrate_noise(observations, options, result);
  return result;
}

std::unique_ptr<const WindowedRegression> make_regression(std::vector<FieldCell> cells, const FieldKernelFit& fit,
                                                          const SlidingGprOptions& options) {
  if (fit.potential) return std::make_unique<CurlFreeRegression>(std::move(cells), *fit.potential, options);
  return std::make_unique<SlidingGpr>(std::move(cells), fit.kernels, options);
}

}  // namespace lodestone
