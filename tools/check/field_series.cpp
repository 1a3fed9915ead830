#include "tools/check/field_series.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "core/evaluation/statistics.h"
#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr double correlation_m = 0.5;  // correlation length of the map's errors
constexpr double largest_delay_s = 1.0;
constexpr double coarse_delay_s = 0.02;
constexpr double fine_delay_s = 0.002;
constexpr Time largest_hole = 200'000'000;
constexpr double matrix_sigma = 0.3;  // prior sigma of the entries of a sensor's matrix
constexpr double offset_sigma_ut = 100.0;

/// Robust rms of normally distributed vectors, from the median of squares.
double robust_rms(const std::vector<Vector3>& vectors) {
  std::vector<double> squares;
  for (const Vector3& vector : vectors) squares.push_back(vector.squaredNorm());
  constexpr double mean_over_median = 3.0 / 2.366;  // of χ² with three degrees of freedom
  return squares.empty() ? 0.0 : std::sqrt(mean_over_median * summarize(squares).median);
}

std::vector<Vector3> without(std::vector<Vector3> vectors, const Vector3& offset) {
  for (Vector3& vector : vectors) vector -= offset;
  return vectors;
}

double independent_readings(const FieldSeries& series) {
  return 1.0 + series.way_m / correlation_m;
}

void fit_turn(const FieldSeries& series, FieldModels& models) {
  Matrix3 cross = Matrix3::Zero();
  for (std::size_t i = 0; i < series.times.size(); ++i)
    cross += series.measured_ut[i] * series.expected_ut[i].transpose();
  const Eigen::JacobiSVD<Matrix3> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Matrix3 turn = svd.matrixU() * Vector3(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  models.turn_rad = Eigen::AngleAxisd(turn).angle();
  std::vector<Vector3> left;
  for (std::size_t i = 0; i < series.times.size(); ++i)
    left.push_back(series.measured_ut[i] - turn * series.expected_ut[i]);
  models.rms_turned_ut = robust_rms(left);
}

/// Fits measured = A expected + b, with a prior of A = 1 and b = 0.
void fit_linear(const FieldSeries& series, FieldModels& models) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  for (std::size_t i = 0; i < series.times.size(); ++i) {
    const Eigen::Vector4d row = series.expected_ut[i].homogeneous();
    normal += row * row.transpose();
    right += row * (series.measured_ut[i] - series.expected_ut[i]).transpose();
  }
  const double variance = std::max(0.1, models.rms_offset_ut * models.rms_offset_ut / 3.0) *
                          static_cast<double>(series.times.size()) / independent_readings(series);
  normal.diagonal() +=
      variance * Eigen::Vector4d(1.0 / (matrix_sigma * matrix_sigma), 1.0 / (matrix_sigma * matrix_sigma),
                                 1.0 / (matrix_sigma * matrix_sigma), 1.0 / (offset_sigma_ut * offset_sigma_ut));
  const Eigen::Matrix<double, 4, 3> solution = normal.ldlt().solve(right);
  const Matrix3 matrix = Matrix3::Identity() + solution.topRows<3>().transpose();
  const Eigen::JacobiSVD<Matrix3> svd(matrix);
  models.scale_error = (svd.singularValues().array() - 1.0).abs().maxCoeff();
  std::vector<Vector3> left;
  for (std::size_t i = 0; i < series.times.size(); ++i) {
    left.push_back(series.measured_ut[i] - matrix * series.expected_ut[i] - solution.row(3).transpose());
  }
  models.rms_linear_ut = robust_rms(left);
}

/// The expected field, interpolated. Only the map is interpolated: interpolated readings would have less noise, which
/// would favour any delay.
std::optional<Vector3> expected_at(const FieldSeries& series, Time time) {
  const auto place = place_in(series.times, time, largest_hole);
  return place ? std::optional<Vector3>(place->value_of(series.expected_ut)) : std::nullopt;
}

/// rms of the differences for a given delay, after subtracting the median.
double rms_delayed(const FieldSeries& series, double delay_s) {
  std::vector<Vector3> left;
  for (std::size_t i = 0; i < series.times.size(); ++i) {
    const auto expected = expected_at(series, series.times[i] - from_seconds(delay_s));
    if (expected) left.push_back(series.measured_ut[i] - *expected);
  }
  if (3 * left.size() < 2 * series.times.size()) return 1e9;
  return robust_rms(without(left, component_medians(left)));
}

void fit_delay(const FieldSeries& series, FieldModels& models) {
  models.rms_undelayed_ut = rms_delayed(series, 0.0);
  const auto look = [&](double from_s, double until_s, double step_s) {
    for (double delay_s = from_s; delay_s <= until_s + 1e-9; delay_s += step_s) {
      const double rms = rms_delayed(series, delay_s);
      if (rms >= models.rms_undelayed_ut) continue;
      models.rms_undelayed_ut = rms;
      models.delay_s = delay_s;
    }
  };
  look(-largest_delay_s, largest_delay_s, coarse_delay_s);
  look(models.delay_s - coarse_delay_s, models.delay_s + coarse_delay_s, fine_delay_s);
}

void fit_drift(const FieldSeries& series, const std::vector<Vector3>& differences, FieldModels& models) {
  const std::size_t third = differences.size() / 3;
  if (third == 0) return;
  const std::vector<Vector3> first(differences.begin(), differences.begin() + static_cast<std::ptrdiff_t>(third));
  const std::vector<Vector3> last(differences.end() - static_cast<std::ptrdiff_t>(third), differences.end());
  models.drift_ut = component_medians(last) - component_medians(first);
  models.drift_sigma_ut = std::sqrt(6.0) * models.offset_sigma_ut;
  const double lasted_s = to_seconds(series.times.back() - series.times.front());
  std::vector<Vector3> left;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    // From the middle of the first third to the middle of the last third: two thirds of the duration.
    const double share = to_seconds(series.times[i] - series.times.front()) / std::max(lasted_s, 1e-9);
    left.push_back(differences[i] - 1.5 * share * models.drift_ut);
  }
  models.rms_drift_ut = robust_rms(without(left, component_medians(left)));
}

}  // namespace

std::vector<Vector3> FieldSeries::differences() const {
  std::vector<Vector3> result;
  for (std::size_t i = 0; i < times.size(); ++i) result.push_back(measured_ut[i] - expected_ut[i]);
  return result;
}

std::vector<FieldSeries> field_series(const FieldComparison& comparison) {
  std::vector<FieldSeries> all(comparison.suite.magnetometers.size());
  std::vector<std::optional<Vector3>> places(all.size());
  compare_field(comparison, [&](const ComparedArray& array) {
    for (const FieldDifference& one : array.differences) {
      const auto j = static_cast<std::size_t>(one.magnetometer);
      FieldSeries& series = all[j];
      const Vector3 difference = one.R_map_mag.transpose() * one.difference_ut;
      const auto expected = comparison.map(one.position);
      if (!expected) continue;
      series.times.push_back(array.time);
      series.expected_ut.push_back(one.R_map_mag.transpose() * expected->field_ut);
      series.measured_ut.push_back(series.expected_ut.back() + difference);
      series.variance_ut2.push_back(one.map_variance + one.pose_variance.trace() / 3.0);
      series.noise_ut2.push_back(one.noise_variance);
      if (places[j]) series.way_m += (one.position - *places[j]).norm();
      places[j] = one.position;
    }
  });
  return all;
}

FieldModels fit_models(const FieldSeries& series) {
  if (series.times.empty()) throw std::invalid_argument("fit_models: a series without readings");
  FieldModels models;
  const std::vector<Vector3> differences = series.differences();
  models.offset_ut = component_medians(differences);
  models.rms_ut = robust_rms(differences);
  models.rms_offset_ut = robust_rms(without(differences, models.offset_ut));
  models.offset_sigma_ut = std::sqrt(summarize(series.variance_ut2).mean / independent_readings(series) +
                                     summarize(series.noise_ut2).mean / static_cast<double>(series.times.size()));
  fit_turn(series, models);
  fit_linear(series, models);
  fit_delay(series, models);
  fit_drift(series, differences, models);
  return models;
}

}  // namespace lodestone
