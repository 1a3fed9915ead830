#include "core/mapping/drive_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lodestone {
namespace {

/// Negative log likelihood of an error with this square under a Student distribution with this variance, up to a
/// constant.
double student_cost(double squared_error, double variance) {
  constexpr double freedom = 5.0;
  return 0.5 * std::log(variance) +
         0.5 * (freedom + 1.0) * std::log1p(squared_error / ((freedom - 2.0) * std::max(variance, 1e-12)));
}

/// sigma_ut for a position sigma, and the cost of both.
DriveError with_position_sigma(const std::vector<HeldOutCell>& cells, double position_sigma_m, double& cost) {
  DriveError result;
  result.position_sigma_m = position_sigma_m;
  cost = 0.0;
  for (int k = 0; k < 3; ++k) {
    std::vector<HeldOutError> errors;
    for (const HeldOutCell& cell : cells) {
      if (!cell.well_predicted[static_cast<std::size_t>(k)]) continue;
      errors.push_back({cell.error_ut[k] * cell.error_ut[k],
                        cell.variance_ut2[k] + position_sigma_m * position_sigma_m * cell.squared_slope[k]});
    }
    if (errors.size() < enough_held_out_cells) continue;
    const double extra = calibrated_noise(errors, 0.0);
    result.sigma_ut[k] = std::sqrt(extra);
    for (const HeldOutError& error : errors) cost += student_cost(error.error, error.predicted + extra);
  }
  return result;
}

Vector3 sigma_shares(const std::vector<HeldOutCell>& cells, const DriveError& drive) {
  std::array<std::vector<HeldOutError>, 3> errors;
  for (const HeldOutCell& cell : cells) {
    const double variance = (cell.variance_ut2 + drive.variance(cell.squared_slope)).mean();
    for (std::size_t k = 0; k < 3; ++k) {
      if (!cell.well_predicted[k]) continue;
      errors[k].push_back({std::pow(cell.error_ut[static_cast<Eigen::Index>(k)], 2), variance});
    }
  }
  Vector3 squares;
  for (std::size_t k = 0; k < 3; ++k) {
    if (errors[k].size() < enough_held_out_cells) return Vector3::Ones();
    squares[static_cast<Eigen::Index>(k)] = trimmed_normalized_square(errors[k], 0.0);
  }
  return squares.minCoeff() > 0.0 ? Vector3((squares / squares.mean()).cwiseSqrt()) : Vector3::Ones();
}

}  // namespace

std::vector<SlopedPrediction> predict_with_slopes(const WindowedRegression& regression,
                                                  const std::vector<Vector3>& points, double step_m) {
  std::vector<Vector3> around;
  for (const Vector3& point : points) {
    around.push_back(point);
    for (const int axis : {0, 1}) {
      for (const double side : {step_m, -step_m}) around.push_back(point + side * Vector3::Unit(axis));
    }
  }
  const std::vector<FieldPrediction> all = regression.predict(around);
  std::vector<SlopedPrediction> result(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    result[i].field = all[5 * i];
    for (std::size_t j = 5 * i + 1; j < 5 * i + 5; j += 2) {
      if (!all[j].supported || !all[j + 1].supported) continue;
      result[i].squared_slope += ((all[j].field_ut - all[j + 1].field_ut) / (2.0 * step_m)).cwiseAbs2();
    }
  }
  return result;
}

DriveError fit_drive_error(const std::vector<HeldOutCell>& cells, double correlation_reach_m) {
  constexpr double step_m = 0.0025;
  constexpr int steps = 40;
  DriveError best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    double cost = 0.0;
    const DriveError candidate = with_position_sigma(cells, step_m * i, cost);
    if (i == 0 && candidate.sigma_ut.isZero()) {  // the predicted variances suffice
      best = candidate;
      break;
    }
    if (!(cost < least)) continue;
    least = cost;
    best = candidate;
  }
  std::vector<NormalizedError> errors;
  double cost = 0.0;
  for (const HeldOutCell& cell : cells) {
    const Vector3 variance = cell.variance_ut2 + best.variance(cell.squared_slope);
    for (int k = 0; k < 3; ++k) {
      cost += student_cost(cell.error_ut[k] * cell.error_ut[k], variance[k]);
      if (!cell.well_predicted[static_cast<std::size_t>(k)]) continue;
      errors.push_back({cell.position, 3 * cell.block + k, cell.error_ut[k] / std::sqrt(variance[k])});
    }
  }
  if (cells.size() >= enough_held_out_cells) best.held_out_cost = cost / (3.0 * static_cast<double>(cells.size()));
  best.sigma_shares = sigma_shares(cells, best);
  best.correlation_m = error_correlation_length(errors, correlation_reach_m);
  return best;
}

double error_correlation_length(const std::vector<NormalizedError>& errors, double reach_m) {
  constexpr int bins = 40;
  constexpr double enough_pairs = 200.0;
  std::array<double, bins> products{}, squares{}, pairs{};
  std::vector<NormalizedError> sorted = errors;
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.block < b.block; });
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    for (std::size_t j = i + 1; j < sorted.size() && sorted[j].block == sorted[i].block; ++j) {
      const double distance = (sorted[i].position - sorted[j].position).norm();
      if (!(distance < reach_m)) continue;
      const auto bin = static_cast<std::size_t>(distance / reach_m * bins);
      products[bin] += sorted[i].value * sorted[j].value;
      squares[bin] += 0.5 * (sorted[i].value * sorted[i].value + sorted[j].value * sorted[j].value);
      pairs[bin] += 1.0;
    }
  }
  double best = 0.0, least = std::numeric_limits<double>::infinity(), all = 0.0;
  for (const double count : pairs) all += count;
  if (all < enough_pairs) return 0.0;
  for (double length = 0.02; length < 10.0; length *= 1.02) {
    double sum = 0.0;
    for (std::size_t bin = 0; bin < bins; ++bin) {
      if (!(squares[bin] > 0.0)) continue;
      const double middle = (static_cast<double>(bin) + 0.5) * reach_m / bins;
      sum += std::pow(products[bin] / squares[bin] - std::exp(-middle / length), 2);
    }
    if (sum < least) {
      least = sum;
      best = length;
    }
  }
  return best;
}

}  // namespace lodestone
