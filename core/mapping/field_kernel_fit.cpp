#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "core/error.h"
#include "core/mapping/kernel_fit.h"
#include "core/mapping/sliding_gpr.h"

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

/// Data sets of one component, each centred at its own first cell.
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
  guess.mean_sigma = 3.0 * spread;  // windows far apart have levels of their own
  guess.signal_sigma = spread;
  guess.length_scale_m = std::max(0.4, 3.0 * cell_m);
  guess.noise_sigma = 0.1 * spread;
  return guess;
}

/// A held-out cell against its prediction, one component, squared.
struct Miss {
  double error;      ///< of the cell's mean
  double predicted;  ///< variance of the prediction and of the cell's white noise
};

/// The mean of error / (predicted + noise) over the best nine tenths, over its value for a normal distribution: 1 where
/// the variances are right. Trimmed, since at steel and at the survey's edge a few errors are far larger than any
/// stationary kernel says.
double trimmed_normalized_square(const std::vector<Miss>& misses, double noise) {
  constexpr double share = 0.9;
  constexpr double normal_value = 0.6231;  // of χ² with one degree of freedom, below its 90 % quantile
  std::vector<double> ratios;
  ratios.reserve(misses.size());
  for (const Miss& miss : misses) ratios.push_back(miss.error / (miss.predicted + noise));
  const auto count = static_cast<std::ptrdiff_t>(share * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), ratios.begin() + count, ratios.end());
  std::sort(ratios.begin(), ratios.begin() + count);  // one order of summation, whatever the library's partition
  return std::accumulate(ratios.begin(), ratios.begin() + count, 0.0) / static_cast<double>(count) / normal_value;
}

/// The noise variance, at least `noise`, that makes the predicted variances right.
double calibrated_noise(const std::vector<Miss>& misses, double noise) {
  constexpr double tolerance = 1.2;  // the scatter of such an estimate
  if (trimmed_normalized_square(misses, noise) <= tolerance) return noise;
  double low = noise;
  double high = noise;
  for (const Miss& miss : misses) high = std::max(high, 4.0 * miss.error);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (trimmed_normalized_square(misses, middle) > 1.0 ? low : high) = middle;
  }
  return high;
}

void calibrate_noise(const std::vector<FieldObservation>& observations, const SlidingGprOptions& options,
                     FieldKernelFit& fit) {
  constexpr std::size_t enough_cells = 50;
  constexpr double well_known = 0.35;  // of the signal's sigma: where there is another pass, or nearly
  // As few blocks as give a thousand cells, since each costs the regression of its surroundings; at most a fifth of all.
  SurveySplit split;
  for (const Time period : {96, 48, 24, 12, 5}) {
    split = split_survey(observations, fit.cell_m, from_seconds(options.calibration_block_s), period);
    if (split.held_out.size() >= 1000) break;
  }
  const auto& [training, held_out] = split;
  if (held_out.size() < enough_cells || training.size() < enough_cells) return;
  std::vector<Vector3> points;
  for (const FieldCell& cell : held_out) points.push_back(cell.position);
  for (int round = 0; round < 4; ++round) {  // more noise changes the prediction too
    const std::vector<FieldPrediction> predictions = SlidingGpr(training, fit.kernels, options).predict(points);
    bool changed = false;
    for (int component = 0; component < 3; ++component) {
      KernelParameters& kernel = fit.kernels[component];
      std::vector<Miss> misses;
      for (std::size_t i = 0; i < held_out.size(); ++i) {
        const double sigma = predictions[i].sigma_ut[component];
        if (!predictions[i].supported || sigma > well_known * kernel.signal_sigma) continue;
        misses.push_back({std::pow(held_out[i].field_ut[component] - predictions[i].field_ut[component], 2),
                          sigma * sigma + held_out[i].variance_ut2});
      }
      if (misses.size() < enough_cells) continue;
      const double noise = kernel.noise_sigma * kernel.noise_sigma;
      const double calibrated = calibrated_noise(misses, noise);
      changed = changed || calibrated > noise;
      kernel.noise_sigma = std::sqrt(calibrated);
    }
    if (!changed) break;
  }
}

}  // namespace

void SlidingGprOptions::check() const {
  const auto require = [](bool good, const char* message) {
    if (!good) throw InputError(std::string("magnetic map: ") + message);
  };
  require(window_points >= 20 && window_points <= 5000, "window_points must lie in 20..5000");
  require(window_length_scales > 0.1 && window_length_scales <= 20.0, "window_length_scales must lie in 0.1..20");
  require(margin_length_scales >= 0.0, "margin_length_scales must not be negative");
  require(reach_length_scales > 0.0 && reach_length_scales <= 10.0, "reach_length_scales must lie in 0..10");
  require(cells_per_length_scale >= 1.0, "cells_per_length_scale must be at least 1");
  require(fit_windows >= 1 && fit_windows <= 1000, "fit_windows must lie in 1..1000");
  require(fit_points >= 10 && fit_points <= 5000, "fit_points must lie in 10..5000");
  require(calibration_block_s >= 0.0, "calibration_block_s must not be negative");
  require(scale_prior_points > 0.0, "scale_prior_points must be positive");
}

FieldKernelFit fit_field_kernels(const std::vector<FieldObservation>& observations, double finest_cell_m,
                                 const SlidingGprOptions& options) {
  FieldKernelFit result;
  result.cell_m = finest_cell_m;
  for (int round = 0; round < 4; ++round) {
    const std::vector<FieldCell> cells = thin_survey(observations, result.cell_m);
    if (cells.size() < 10) {
      throw InputError("magnetic map: the survey covers " + std::to_string(cells.size()) + " cells of " +
                       std::to_string(result.cell_m) + " m, at least 10 are needed; survey a longer way");
    }
    std::mt19937_64 generator(static_cast<std::uint64_t>(options.seed));
    std::vector<std::vector<int>> windows;
    const auto size = static_cast<std::size_t>(options.fit_points);
    const std::size_t count = cells.size() <= size ? 1 : static_cast<std::size_t>(options.fit_windows);
    for (std::size_t i = 0; i < count; ++i) {
      windows.push_back(nearest_cells(cells, cells[generator() % cells.size()].position, size));
    }
    double shortest = 0.0;
    for (int component = 0; component < 3; ++component) {
      KernelParameters start = first_guess(cells, component, result.cell_m);
      KernelBounds bounds;
      bounds.min_length_scale_m = result.cell_m;
      bounds.min_sigma = 1e-3;
      if (round > 0) start.length_scale_m = result.kernels[component].length_scale_m;
      const KernelFit fit = fit_kernel(component_sets(cells, windows, component), start, bounds);
      result.kernels[component] = fit.parameters;
      result.evaluations += fit.evaluations;
      shortest = component == 0 ? fit.parameters.length_scale_m : std::min(shortest, fit.parameters.length_scale_m);
    }
    result.windows = static_cast<int>(count);
    // A field that is smooth over many cells needs fewer of them, and the windows for the fit must span several length
    // scales to see one.
    const double wanted = shortest / options.cells_per_length_scale;
    if (wanted < 1.3 * result.cell_m) break;
    result.cell_m = wanted;
  }
  for (int k = 0; k < 3; ++k) result.uncalibrated_noise[k] = result.kernels[k].noise_sigma;
  if (options.calibration_block_s > 0.0) calibrate_noise(observations, options, result);
  return result;
}

}  // namespace lodestone
