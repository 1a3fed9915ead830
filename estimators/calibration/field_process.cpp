#include "estimators/calibration/field_process.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr double kUsualField_ut = 50.0;    // that is rotated with the gyroscope's noise
constexpr double kAnyField_ut = 200.0;     // prior of an unknown field
constexpr double kLeastStep_ut = 0.01;     // between moments, for the conditioning of the solver
constexpr double kUsualExcess = 4.0;       // ratio of a place's mean square to that of most places
constexpr double kMapErrorLasts_s = 60.0;  // at a standstill: errors of the pose change, too
constexpr std::array<double, 5> kLags_s{0.5, 1.0, 2.0, 4.0, 8.0};
constexpr double kLeastWalk_ut = 0.02, kLeastSlope_ut_m = 0.5, kLeastSlopeWalk_ut_m = 0.1;

double seconds_since_last(const CalibrationLog& log, std::size_t moment) {
  return to_seconds(log.moments[moment].time - log.moments[moment - 1].time);
}

/// Correlation of the map's error at a moment with that at the previous one.
double map_likeness(const CalibrationLog& log, std::size_t moment, const CalibrationOptions& options) {
  return std::exp(-log.moments[moment].moved_m / options.map_correlation_m -
                  seconds_since_last(log, moment) / kMapErrorLasts_s);
}

/// x' = ρ x + w with a constant variance of x; the sigmas of the two states may differ.
StepWeights stationary(double likeness, double sigma_before, double sigma_after) {
  const double step = std::sqrt(std::max(1e-8, 1.0 - likeness * likeness));
  return {1.0 / (sigma_after * step), likeness / (sigma_before * step)};
}

/// Mean squared change of a component over a lag, per second; the largest over all lags. `states`: in axes that do not
/// rotate. `stretch`: index of each state's stretch.
template <class State>
double largest_walk(const CalibrationLog& log, const std::vector<State>& states, const std::vector<int>& stretch) {
  double largest = 0.0;
  for (const double lag_s : kLags_s) {
    double sum = 0.0;
    std::size_t pairs = 0;
    for (std::size_t i = 0, k = 0; i < states.size(); ++i) {
      while (k < states.size() && to_seconds(log.moments[k].time - log.moments[i].time) < lag_s) ++k;
      if (k == states.size()) break;
      if (stretch[k] != stretch[i]) continue;
      sum += (states[k] - states[i]).squaredNorm() / static_cast<double>(states[i].size()) /
             to_seconds(log.moments[k].time - log.moments[i].time);
      ++pairs;
    }
    if (pairs > 10) largest = std::max(largest, sum / static_cast<double>(pairs));
  }
  return std::sqrt(largest);
}

/// Ratio of the map's error at each place to that at most places, which is at least its sigma.
std::vector<double> place_scales(const CalibrationLog& log, const FieldStates& states) {
  std::vector<double> squares(log.places, 0.0), counts(log.places, 0.0);
  for (std::size_t k = 0; k < states.field_ut.size(); ++k) {
    const CalibrationMoment& moment = log.moments[k];
    squares[moment.place] +=
        states.field_ut[k].squaredNorm() * moment.passes / (3.0 * std::pow(moment.map_sigma_ut, 2));
    counts[moment.place] += 1.0;
  }
  for (std::size_t i = 0; i < log.places; ++i) squares[i] /= counts[i];
  const double usual = kUsualExcess * std::max(1.0, middle_value(squares));
  for (double& square : squares) square = std::max(1.0, square / usual);
  return squares;
}

}  // namespace

StepWeights field_step(const CalibrationLog& log, std::size_t moment, const FieldProcess& process,
                       const CalibrationOptions& options) {
  const CalibrationMoment& now = log.moments[moment];
  if (log.mapped) {
    return stationary(map_likeness(log, moment, options), map_sigma(log.moments[moment - 1], process),
                      map_sigma(now, process));
  }
  const double variance = std::pow(process.step_ut_sqrt_s, 2) * seconds_since_last(log, moment) +
                          std::pow(now.turn_sigma * kUsualField_ut, 2) + std::pow(kLeastStep_ut, 2);
  return {1.0 / std::sqrt(variance), 1.0 / std::sqrt(variance)};
}

StepWeights slope_step(const CalibrationLog& log, std::size_t moment, const FieldProcess& process,
                       const CalibrationOptions& options) {
  if (log.mapped) {
    return stationary(map_likeness(log, moment, options),
                      slope_start_sigma(log.moments[moment - 1], true, process, options),
                      slope_start_sigma(log.moments[moment], true, process, options));
  }
  const double share = 0.5 * std::pow(process.slope_step_ut_m_sqrt_s / process.slope_ut_m, 2);
  return stationary(std::exp(-share * seconds_since_last(log, moment)), process.slope_ut_m, process.slope_ut_m);
}

double field_start_sigma(const CalibrationMoment& moment, bool mapped, const FieldProcess& process) {
  return mapped ? map_sigma(moment, process) : kAnyField_ut;
}

double map_sigma(const CalibrationMoment& moment, const FieldProcess& process) {
  const double place = process.place_scale.empty() ? 1.0 : process.place_scale[moment.place];
  return process.map_scale * place * moment.map_sigma_ut;
}

double slope_start_sigma(const CalibrationMoment& moment, bool mapped, const FieldProcess& process,
                         const CalibrationOptions& options) {
  return mapped ? map_sigma(moment, process) / options.map_correlation_m : process.slope_ut_m;
}

FieldProcess observed_process(const CalibrationLog& log, const FieldStates& states, const Vector3& gyroscope_bias,
                              const Matrix3& common) {
  const Matrix3 undistorted = common.inverse();
  std::vector<Vector3> field(states.field_ut.size());
  std::vector<FieldSlope> slope(field.size());
  std::vector<int> stretch(field.size(), 0);
  Quaternion attitude = Quaternion::Identity();
  double squares = 0.0;
  for (std::size_t k = 0; k < field.size(); ++k) {
    const CalibrationMoment& moment = log.moments[k];
    if (moment.follows)
      attitude = (attitude * moment.turn * so3::exp(moment.turn_by_bias * gyroscope_bias)).normalized();
    if (k > 0) stretch[k] = stretch[k - 1] + (moment.follows ? 0 : 1);
    field[k] = attitude * (undistorted * states.field_ut[k]);
    slope[k] = turned_slope(attitude.toRotationMatrix()) * states.slope_ut_m[k];
    squares += slope[k].squaredNorm() / 5.0;
  }
  FieldProcess process;
  process.step_ut_sqrt_s = std::max(kLeastWalk_ut, largest_walk(log, field, stretch));
  process.slope_ut_m = std::max(kLeastSlope_ut_m, std::sqrt(squares / static_cast<double>(field.size())));
  process.slope_step_ut_m_sqrt_s = std::max(kLeastSlopeWalk_ut_m, largest_walk(log, slope, stretch));
  return process;
}

FieldProcess observed_map_error(const CalibrationLog& log, const FieldStates& states, const FieldProcess& process,
                                const CalibrationOptions& options) {
  FieldProcess result = process;
  result.place_scale = place_scales(log, states);
  const auto usual = [&](std::size_t k) { return result.place_scale[log.moments[k].place] <= 1.0; };
  double squares = 0.0;
  std::size_t steps = 0;
  for (std::size_t k = 1; k < states.field_ut.size(); ++k) {
    if (!log.moments[k].follows || !usual(k) || !usual(k - 1)) continue;
    const StepWeights weights = field_step(log, k, result, options);
    squares += (weights.after * states.field_ut[k] -
                weights.before * (log.moments[k].turn.conjugate() * states.field_ut[k - 1]))
                   .squaredNorm() /
               3.0;
    ++steps;
  }
  if (steps > 0) result.map_scale *= std::max(1.0, std::sqrt(squares / static_cast<double>(steps)));
  return result;
}

}  // namespace lodestone
