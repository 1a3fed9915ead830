#include "estimators/baselines/field_matching.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimators/smoother/field_weighting.h"

namespace lodestone {

namespace {

constexpr double kStudentDegrees = 4.0;
/// The interpolation of the paper.
constexpr FieldInterpolation kMatchingInterpolation = FieldInterpolation::bilinear;

/// Weight of a residual under the Student distribution, in the M step of its expectation maximization.
double student_weight(double squared_distance) {
  return std::min(1.0, (kStudentDegrees + 3.0) / (kStudentDegrees + squared_distance));
}

}  // namespace

double mean_crowding(const SensorSuite& suite, double correlation_m) {
  const std::vector<double> crowding = array_crowding(suite, correlation_m);
  return std::accumulate(crowding.begin(), crowding.end(), 0.0) / static_cast<double>(crowding.size());
}

FieldMatching::FieldMatching(const EstimatorInput& input)
    : input_(input),
      background_(field_background(*input.field)),
      correlation_m_(map_correlation_m(input.options.magnetic, *input.field)),
      crowding_(mean_crowding(input.suite, correlation_m_)) {}

MatchedScan FieldMatching::match(const ScanBundle& bundle, const NavState& end) const {
  MatchedScan result;
  if (bundle.magnetic.empty() || bundle.imu.empty()) return result;
  const std::vector<ArrayReading> arrays = average_array(bundle.magnetic, ScanMotion(end, bundle.imu), input_.suite,
                                                         input_.options.magnetic.samples_per_reading);
  const double step_s = to_seconds(bundle.imu.back().time - bundle.imu.front().time);
  for (const ArrayReading& array : arrays) {
    MatchedScan::Array matched;
    for (const MeanReading& reading : array.readings) {
      MatchedScan::Reading one;
      one.position = reading.T_end_mag.position;
      one.measured_ut = reading.T_end_mag.rotation * reading.measured_ut;
      one.variance_ut2 = sensor_variance_ut2(reading, input_.suite);
      matched.readings.push_back(one);
    }
    set_information_share(end, end.velocity.norm() * step_s / static_cast<double>(arrays.size()), matched);
    result.arrays.push_back(std::move(matched));
  }
  return result;
}

FieldMatching::Residual FieldMatching::residual(const MatchedScan::Reading& reading, const Pose& T_map_imu) const {
  const Vector3 measured_ut = T_map_imu.rotation * reading.measured_ut;
  const auto field = input_.field->query(T_map_imu * reading.position, kMatchingInterpolation);
  Residual result;
  if (!field) {
    result.squared_ut2 = (measured_ut - background_.mean_ut).squaredNorm();
    result.variance_ut2 = reading.variance_ut2 + background_.sigma_ut * background_.sigma_ut;
    result.log_prior = std::log(kStaleShare);
    return result;
  }
  const double by_place =
      input_.suite.calibration.magnetometers.translation_sigma_m * field->gradient.norm() / std::sqrt(3.0);
  const double map_sigma_ut =
      input_.options.magnetic.map_sigma ? std::hypot(std::max(field->sigma_ut, kMapSigmaFloor_ut), by_place) : 0.0;
  result.on_map = true;
  result.squared_ut2 = (measured_ut - field->field_ut).squaredNorm();
  result.map_variance_ut2 = map_sigma_ut * map_sigma_ut;
  result.variance_ut2 = reading.variance_ut2 + result.map_variance_ut2;
  return result;
}

/// The share is the variance of single readings over the variance that their mean has if errors of map and calibration
/// repeat (docs/design/013-correlated-field-map-error.md). One share serves all poses, so that these are comparable.
void FieldMatching::set_information_share(const NavState& end, double spacing_m, MatchedScan::Array& array) const {
  const double repeats = correlation_inflation(spacing_m, correlation_m_);
  double single = 0.0;
  double repeated = 0.0;
  for (const MatchedScan::Reading& reading : array.readings) {
    const Residual found = residual(reading, end.T_map_imu);
    single += found.variance_ut2;
    repeated += repeats * (reading.variance_ut2 + crowding_ * found.map_variance_ut2);
  }
  if (repeated > single) array.information_share = single / repeated;
}

double FieldMatching::log_likelihood(const MatchedScan& scan, const Pose& T_map_imu) const {
  double sum = 0.0;
  for (const MatchedScan::Array& array : scan.arrays) {
    double of_array = 0.0;
    for (const MatchedScan::Reading& reading : array.readings) {
      const Residual found = residual(reading, T_map_imu);
      of_array += found.log_prior;
      of_array -=
          1.5 * std::log(found.variance_ut2) +
          0.5 * (kStudentDegrees + 3.0) * std::log1p(found.squared_ut2 / (kStudentDegrees * found.variance_ut2));
    }
    sum += array.information_share * of_array;
  }
  return sum;
}

void FieldMatching::report(const MatchedScan& scan, const Pose& T_map_imu, Diagnostics& diagnostics) const {
  double squared_ut2 = 0.0;
  int on_map = 0;
  for (const MatchedScan::Array& array : scan.arrays) {
    double weight = 0.0;
    int count = 0;
    for (const MatchedScan::Reading& reading : array.readings) {
      const Residual found = residual(reading, T_map_imu);
      if (!found.on_map) {
        ++diagnostics.magnetic_off_map;
        continue;
      }
      weight += student_weight(found.squared_ut2 / found.variance_ut2);
      squared_ut2 += found.squared_ut2;
      ++count;
    }
    on_map += count;
    if (count == 0) continue;
    ++diagnostics.magnetic_samples;
    diagnostics.magnetic_weight += weight / count;
    if (weight / count < 0.5) ++diagnostics.magnetic_rejected;
  }
  if (diagnostics.magnetic_samples > 0) diagnostics.magnetic_weight /= diagnostics.magnetic_samples;
  if (on_map > 0) diagnostics.magnetic_residual_ut = std::sqrt(squared_ut2 / (3.0 * on_map));
}

}  // namespace lodestone
