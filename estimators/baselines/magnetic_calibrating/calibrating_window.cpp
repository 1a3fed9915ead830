#include "estimators/baselines/magnetic_calibrating/calibrating_window.h"

#include <cmath>
#include <limits>

#include "core/robust_weight.h"
#include "estimators/layer_height.h"

namespace lodestone {

namespace {

/// A round that lowers the cost by less moves no variable by more than a tenth of its sigma
/// (docs/design/055-magnetic-calibrating.md).
constexpr double kLeastDecreaseOfRound = 5e-3;

MagneticOptions without_array_weights(MagneticOptions options) {
  options.huber = false;
  return options;
}

SlidingWindowOptions with_bias_states() {
  SlidingWindowOptions options;
  options.magnetometer_bias_states = true;
  return options;
}

/// Hard iron, soft iron and misalignment are estimated; everything else is as in the platform file.
CalibrationSigmas magnetometers_only(const CalibrationSigmas& given) {
  CalibrationSigmas result = exact_calibration();
  result.magnetometers = given.magnetometers;
  result.magnetometers.clock_sigma_s = 0.0;
  return result;
}

}  // namespace

CalibratingWindow::CalibratingWindow(Time time, const NavState& state, const Matrix17& covariance,
                                     const SensorSuite& suite, std::shared_ptr<const MagneticMap> map,
                                     const MagneticOptions& options)
    : suite_(suite),
      map_(std::move(map)),
      options_(without_array_weights(options)),
      crowding_(array_crowding(suite, map_correlation_m(options, *map_))),
      huber_threshold_(options.huber ? mahalanobis_quantile(3, options.huber_probability)
                                     : std::numeric_limits<double>::infinity()),
      window_(time, state, covariance, static_cast<int>(suite.magnetometers.size()), suite.imu, with_bias_states(),
              magnetometers_only(suite.calibration)) {
  readings_.emplace_back();
  hold_height(state.T_map_imu);
}

void CalibratingWindow::add_keyframe(Time time, const NavState& predicted, std::span<const ImuSample> samples) {
  window_.add_keyframe(time, predicted, samples);
  readings_.emplace_back();
  hold_height(predicted.T_map_imu);
}

/// A map of one layer holds at its height only, and does not observe it.
void CalibratingWindow::hold_height(const Pose& T_map_imu) {
  if (map_->grid().heights_m.size() != 1 || suite_.magnetometers.empty()) return;
  const Vector3 center = array_center(suite_);
  MeasuredPose height{T_map_imu};
  height.T_map_imu.position.z() += map_->grid().heights_m.front() - (T_map_imu * center).z();
  height.root.row(0) = height_by_pose(T_map_imu, center) / kLayerHeightSigma_m;
  window_.set_field_pose(window_.size() - 1, height, {});
}

FieldStatistics CalibratingWindow::set_readings(std::span<const ArrayReading> arrays, double spacing_m) {
  const std::size_t newest = window_.size() - 1;
  const FieldWeighting weighting{.suite = suite_,
                                 .map = *map_,
                                 .options = options_,
                                 .crowding = crowding_,
                                 .sensor_gate = 0.0,
                                 .bias_ut = [&](int j) { return window_.magnetometer_bias(newest, j); },
                                 .matrix = [&](int j) { return window_.magnetometer_matrix(j); },
                                 .clock = {}};
  FieldStatistics statistics;
  readings_.back() =
      weigh_field(arrays, window_.state(newest).T_map_imu, Matrix6::Zero(), spacing_m, 1.0, weighting, statistics);
  renew_weights();
  return statistics;
}

Vector3 CalibratingWindow::residual_ut(std::size_t k, const FieldReading& reading) const {
  const Pose T_map_imu = window_.state(k).T_map_imu;
  const Vector3 place = T_map_imu * reading.T_end_mag.position;
  auto field = map_->query(place, options_.interpolation);
  if (!field) field = reading.field_beyond(place);
  return calibrated_residual(T_map_imu, reading.T_end_mag, reading.measured_ut,
                             window_.magnetometer_bias(k, reading.magnetometer),
                             window_.magnetometer_matrix(reading.magnetometer), *field)
      .residual_ut;
}

void CalibratingWindow::renew_weights() {
  beyond_huber_ = 0.0;
  for (std::size_t k = 0; k < readings_.size(); ++k) {
    for (FieldReading& reading : readings_[k]) {
      const double distance = residual_ut(k, reading).norm() / reading.sigma_ut;
      reading.weight = huber_weight(distance, huber_threshold_);
      // ρ(s) = 2 c s − c² and w s² = c s beyond the threshold c.
      if (distance > huber_threshold_) beyond_huber_ += 0.5 * huber_threshold_ * (distance - huber_threshold_);
    }
    window_.set_field(k, map_, options_.interpolation, readings_[k], {});
  }
}

double CalibratingWindow::minimize(SlidingWindow::Part part) {
  iterations_ += window_.solve_part(part);
  renew_weights();
  return joint_cost();
}

int CalibratingWindow::alternate(int most_rounds) {
  iterations_ = 0;
  double before = joint_cost();
  for (int round = 0; round < most_rounds; ++round) {
    localize();
    const double after = calibrate();
    if (before - after < kLeastDecreaseOfRound) break;
    before = after;
  }
  return iterations_;
}

CalibratingWindow::Fit CalibratingWindow::newest_fit() const {
  Fit fit;
  const std::vector<FieldReading>& newest = readings_.back();
  if (newest.empty()) return fit;
  const double count = static_cast<double>(newest.size());
  double squared = 0.0;
  for (const FieldReading& reading : newest) {
    fit.weight += reading.weight / count;
    squared += residual_ut(readings_.size() - 1, reading).squaredNorm();
  }
  fit.residual_rms_ut = std::sqrt(squared / (3.0 * count));
  return fit;
}

void CalibratingWindow::marginalize_oldest() {
  window_.marginalize_oldest();
  readings_.pop_front();
}

}  // namespace lodestone
