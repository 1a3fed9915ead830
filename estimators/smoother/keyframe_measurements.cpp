#include "estimators/smoother/keyframe_measurements.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/geometry/slide.h"
#include "core/imu/scan_motion.h"
#include "core/lidar/deskew.h"
#include "core/lidar/least_squares_error.h"
#include "core/observability/single_scan.h"
#include "core/robust_weight.h"
#include "core/wheels/wheel_residual.h"
#include "estimators/layer_height.h"
#include "estimators/smoother/field_pose.h"
#include "estimators/smoother/field_weighting.h"

namespace lodestone {

namespace {

/// The field of one scan does not observe a direction if its information is below this share of the prediction's. The
/// share is far below what the scans of a window add up to.
constexpr double kUnseenGain = 1e-3;

/// Share by which a hard mask follows each new analysis: a larger share adds up noise of degenerate directions to
/// information (docs/design/010-unobservable-rigid-motion.md).
constexpr double kFollowGain = 0.01;

/// Of the residual of one point with the scan's mean information, m. What a window of scans knows no better is known
/// from hardly any point: a direction is degenerate by its geometry, not by the noise of sensor and map
/// (docs/design/068).
double sigma_of_a_point(const CondensedCost& cost) {
  return cost.weight_sum > 0.0 ? std::sqrt(static_cast<double>(cost.count) / cost.weight_sum) : 0.0;
}

/// A direction that no field holds beside LiDAR is degenerate only beyond this sigma, far from halls (up to 0.02 m) and
/// from tunnels (from 0.07 m, most of it spurious; docs/design/068).
constexpr double kAlone_m = 0.03;

/// Least sigma of bends, as the log shows them, whose displacement is estimated: in a straight map, the estimate costs
/// accuracy (docs/design/069).
constexpr double kBent_m = 0.005;

/// A magnetometer is rejected beyond this χ² quantile of its deviation from the prediction by the rest of the array
/// (docs/design/018-magnetometer-faults.md).
constexpr double kSensorProbability = 0.9999;

constexpr auto kHeightVariance_m2 = static_cast<float>(kLayerHeightSigma_m * kLayerHeightSigma_m);

}  // namespace

KeyframeMeasurements::KeyframeMeasurements(EstimatorInput input)
    : input_(std::move(input)),
      crowding_(input_.field == nullptr
                    ? std::vector<double>{}
                    : array_crowding(input_.suite, map_correlation_m(input_.options.magnetic, *input_.field))),
      sensor_gate_(mahalanobis_quantile(3, kSensorProbability)) {
  // Without LiDAR the height is unobservable, and a map of one layer holds at its height only (docs/design/017).
  if (input_.field != nullptr && input_.field->grid().heights_m.size() == 1) {
    level_ = std::make_unique<Plane>();
    level_->normal = Eigen::Vector3f::UnitZ();
    level_->major = Eigen::Vector3f::UnitX();
    level_->center = Eigen::Vector3f(0.0F, 0.0F, static_cast<float>(input_.field->grid().heights_m.front()));
  }
}

void KeyframeMeasurements::register_scan(Keyframe& keyframe, const NavState& state, const NavState* before) const {
  const RunOptions& options = input_.options;
  keyframe.associated = moved_by(keyframe.map_error, state.T_map_imu);
  if (input_.planes == nullptr) {
    hold_height(keyframe);
    keyframe.lidar = condense_scan(keyframe.correspondences, keyframe.associated);
    return;
  }
  const ScanMotion motion =
      before == nullptr ? ScanMotion(state, keyframe.imu) : ScanMotion(*before, state, keyframe.imu);
  // In the IMU's clock.
  const Time scan_start = keyframe.scan_start - keyframe.lidar_correction.clock();
  const ScanLidars lidars(keyframe.lidar_correction.corrected(input_.suite.lidars()), keyframe.points);
  const Pose& T_imu_lidar = lidars.models.front().T_imu_lidar;
  const std::vector<Eigen::Vector3f> points = deskew(keyframe.points, scan_start, motion, T_imu_lidar);
  const std::shared_ptr<const PlaneMap> planes = input_.planes->around(state.T_map_imu.position);
  const std::vector<float> ages_s = ages_at(keyframe.estimate.time, keyframe.points, scan_start);
  AssociationOptions association = options.lidar.association;
  if (options.smoother.solver.map_error_states) association.map_error_repeats = 1.0;  // the rest is a state
  keyframe.correspondences = associate(points, keyframe.associated, keyframe.gate_covariance, *planes, lidars,
                                       association, ages_s, keyframe.variance_scale);
  keyframe.planes = planes;
  const auto matched = static_cast<int>(keyframe.correspondences.size());
  std::optional<BentMapFit> fit;
  // LiDAR outage of a robot that was at the height of the map's layer.
  if (matched == 0 && at_level(state.T_map_imu)) hold_height(keyframe);
  if (matched == 0) {
    keyframe.lidar = condense_scan(keyframe.correspondences, keyframe.associated);
  } else {
    Deskewing deskewing(state, motion, keyframe.imu_noise);
    if (before == nullptr) {
      const InitialOptions& initial = options.initial;
      const double tilted_m_s2 = input_.suite.gravity_m_s2 * initial.gravity_sigma_deg * M_PI / 180.0;
      deskewing.gyroscope_bias_variance = std::pow(initial.gyroscope_bias_sigma_rad_s, 2);
      deskewing.acceleration_variance = std::pow(initial.accelerometer_bias_sigma_m_s2, 2) + tilted_m_s2 * tilted_m_s2;
    }
    if (keyframe.motion_waits) deskewing = {};
    MapErrorVariances variances_m2 = keyframe.long_map_error_variances_m2;
    // Where gates are wide and nothing is known of this map, one moved object nearby would outweigh all that is far
    // away.
    // In a corridor without features, the fit of a place that is known to ten metres made the estimate unstable.
    const Eigen::SelfAdjointEigenSolver<Matrix3> place(keyframe.gate_covariance.bottomRightCorner<3, 3>(),
                                                       Eigen::EigenvaluesOnly);
    const bool bent = keyframe.map_is_compared && variances_m2.sum() > kBent_m * kBent_m &&
                      place.eigenvalues()[2] < kUnknownPlace_m * kUnknownPlace_m;
    Matrix6 near = Matrix6::Zero();
    LongMapError far;
    if (bent && options.smoother.solver.map_error_states) {
      variances_m2[0] = keyframe.map_error_variance_m2;
      fit = fit_in_bent_map(keyframe.correspondences, keyframe.associated, variances_m2);
      near = keyframe.map_error_variance_m2 * fit->cube_covariance;
      far = fit->long_error;
    } else {
      const MapError error = analyse_map_error(keyframe.correspondences, keyframe.associated);
      near = keyframe.map_error_variance_m2 * cube_covariance_of(error);
      far = long_error_of(error, variances_m2);
    }
    Matrix6 within_scan = near;
    if (!keyframe.map_is_compared) within_scan += far.covariance;
    keyframe.lidar = condense_scan(fit ? fit->straightened : keyframe.correspondences, keyframe.associated, deskewing,
                                   {within_scan, fit.has_value()});
    keyframe.lidar.by_lidar = true;
    keyframe.lidar.correction = keyframe.lidar_correction;
    keyframe.lidar.beam_origin_m = T_imu_lidar.position;
    keyframe.lidar.map_error_root = pose_error_root(near);
    keyframe.lidar.long_map_error_root = pose_error_root(far.covariance);
    keyframe.lidar.long_map_error_length_m = far.length_m;
  }
  const CondensedCost& cost = keyframe.lidar.cost;
  // A direction is degenerate by the geometry of the scan, not by what bends of the map leave of it.
  keyframe.lidar_information = cost.hessian(keyframe.associated) - kNormalNoiseMargin * cost.spurious_information;
  keyframe.seen_share = fit ? fit->seen_share : cost.seen_share(keyframe.associated);
  if (options.degeneracy.rule == DegeneracyRule::paper) {
    keyframe.unit_hessian = unit_hessian(keyframe.correspondences, keyframe.associated);
  }
  Diagnostics& diagnostics = keyframe.estimate.diagnostics;
  diagnostics.points = static_cast<int>(points.size());
  diagnostics.correspondences = matched;
  diagnostics.unobserved_directions = unobserved_directions(
      analyse_by_sigma(keyframe.lidar_information, std::max(keyframe.lidar.cost.range_rms_m, 1.0), {}));
  diagnostics.lidar_nis = normalized_residuals(keyframe.correspondences, keyframe.associated);
  diagnostics.inlier_share = points.empty() ? 0.0 : static_cast<double>(matched) / static_cast<double>(points.size());
}

bool KeyframeMeasurements::at_level(const Pose& T_map_imu) const {
  if (level_ == nullptr) return false;
  const double height_m = (T_map_imu * array_center(input_.suite)).z();
  return std::abs(height_m - static_cast<double>(level_->center.z())) < 3.0 * kLayerHeightSigma_m;
}

void KeyframeMeasurements::hold_height(Keyframe& keyframe) const {
  keyframe.correspondences.clear();
  if (level_ != nullptr) {
    for (const MagnetometerModel& magnetometer : input_.suite.magnetometers) {
      keyframe.correspondences.push_back(
          {magnetometer.T_imu_mag.position.cast<float>(), level_.get(), kHeightVariance_m2});
    }
  }
}

bool KeyframeMeasurements::has_field(const Keyframe& keyframe, const Vector3& position) const {
  return input_.field != nullptr && !keyframe.magnetic.empty() &&
         input_.field->query(position, input_.options.magnetic.interpolation).has_value();
}

Degeneracy KeyframeMeasurements::analyse(const Keyframe& keyframe, const NavState& state,
                                         const std::function<Matrix6(double noise_subtracted)>& known) const {
  DegeneracyOptions options = input_.options.degeneracy;
  if (input_.planes == nullptr || options.rule == DegeneracyRule::none) return no_degeneracy();
  if (options.rule == DegeneracyRule::paper) {
    return analyse_by_eigenvalue(keyframe.unit_hessian, options);
  }
  options.max_sigma_m = std::max(options.max_sigma_m, sigma_of_a_point(keyframe.lidar.cost));
  // Without a field, a masked direction is left to the IMU, and to wheels.
  if (!has_field(keyframe, state.T_map_imu.position)) options.max_sigma_m = std::max(options.max_sigma_m, kAlone_m);
  const double lever_arm_m = std::max(keyframe.lidar.cost.range_rms_m, 1.0);
  const Vector3 up = state.T_map_imu.rotation.conjugate() * -state.gravity.normalized();
  if (options.rule == DegeneracyRule::probabilistic) {
    const Matrix6 once = known(1.0);
    return without_tilt(analyse_by_probability(once, known(0.0) - once, keyframe.correspondences, keyframe.associated,
                                               lever_arm_m, options),
                        up);
  }
  return without_tilt(analyse_by_sigma(known(kNormalNoiseMargin), lever_arm_m, options), up);
}

void KeyframeMeasurements::decide(Keyframe& keyframe, const Degeneracy& analysed, const Degeneracy* before,
                                  const Pose& pose_before) const {
  keyframe.degeneracy =
      before == nullptr ? analysed : follow(analysed, keyframe.associated, *before, pose_before, kFollowGain);
  keyframe.analysed = keyframe.associated;
  if (input_.planes == nullptr) return;
  Diagnostics& diagnostics = keyframe.estimate.diagnostics;
  diagnostics.direction_sigma_m = keyframe.degeneracy.sigma_m;
  diagnostics.direction_weight = keyframe.degeneracy.kept;
  diagnostics.degenerate_directions = keyframe.degeneracy.degenerate_directions;
  diagnostics.lidar_rmse_m =
      keyframe.lidar.cost.count == 0
          ? 0.0
          : std::sqrt(std::max(0.0, keyframe.lidar.cost.cost(keyframe.associated)) / keyframe.lidar.cost.weight_sum);
}

void KeyframeMeasurements::set_lidar(const Keyframe& keyframe, std::size_t k, SlidingWindow& window) const {
  if (input_.planes == nullptr) {
    window.set_lidar(k, keyframe.lidar, keyframe.correspondences, {});
    return;
  }
  window.set_lidar(k, keyframe.lidar, keyframe.correspondences, lidar_mask(keyframe));
}

PoseMask KeyframeMeasurements::lidar_mask(const Keyframe& keyframe) const {
  return {keyframe.seen_share * keyframe.degeneracy.lidar_projector(), keyframe.associated,
          keyframe.degeneracy.slide(keyframe.associated)};
}

KeyframeField KeyframeMeasurements::weigh(Keyframe& keyframe, const NavState& state,
                                          const std::function<Vector3(int)>& bias_ut,
                                          const std::function<Matrix3(int)>& matrix,
                                          const SlidingWindow::ClockOffset& clock) const {
  const RunOptions& options = input_.options;
  Diagnostics& diagnostics = keyframe.estimate.diagnostics;
  double factor = 1.0;
  KeyframeField result;
  if (input_.planes != nullptr && options.degeneracy.rule != DegeneracyRule::none) {
    if (keyframe.degeneracy.degenerate_directions > 0) {
      // Only the paper's rule masks the field. If the calibration is estimated, a masked field would explain its
      // residuals by errors of the other directions (docs/design/043).
      if (options.degeneracy.rule == DegeneracyRule::paper) {
        result.mask = PoseMask(keyframe.degeneracy.magnetic_projector(), state.T_map_imu);
      }
    } else if (options.magnetic.shrink != MagneticShrink::none) {
      factor = options.magnetic.beta * options.magnetic.beta;
    }
  }
  diagnostics.magnetic_shrink = std::sqrt(factor);
  if (input_.field == nullptr || keyframe.magnetic.empty()) return result;

  const std::vector<ArrayReading> arrays = average_array(keyframe.magnetic, ScanMotion(state, keyframe.imu),
                                                         input_.suite, options.magnetic.samples_per_reading);
  if (arrays.empty()) return result;
  const double spacing_m = state.velocity.norm() * to_seconds(keyframe.imu.back().time - keyframe.imu.front().time) /
                           static_cast<double>(arrays.size());
  const FieldWeighting weighting{input_.suite, *input_.field, options.magnetic,
                                 crowding_,    sensor_gate_,  bias_ut,
                                 matrix,       clock,         keyframe.field_variance_ut2};
  FieldStatistics statistics;
  // Huber weights are computed at the prediction, which does not depend on these readings.
  const auto weighed = [&](std::span<const ArrayReading> some) {
    return weigh_field(some, keyframe.predicted, keyframe.predicted_covariance, spacing_m, factor, weighting,
                       statistics);
  };
  if (options.magnetic.measurement == MagneticMeasurement::pose) {
    std::vector<std::vector<FieldReading>> samples;
    samples.reserve(arrays.size());
    for (const ArrayReading& array : arrays) samples.push_back(weighed({&array, 1}));
    result.pose = field_pose(samples, keyframe.predicted, keyframe.predicted_covariance, *input_.field,
                             options.magnetic.interpolation, kUnseenGain);
  } else {
    result.readings = weighed(arrays);
    keyframe.field_readings = result.readings;
  }
  diagnostics.magnetic_samples = statistics.arrays;
  diagnostics.magnetic_rejected = statistics.rejected;
  diagnostics.magnetic_off_map = statistics.off_map;
  diagnostics.magnetic_set_aside = statistics.set_aside;
  diagnostics.magnetic_weight = statistics.arrays == 0 ? 0.0 : statistics.weight_sum / statistics.arrays;
  diagnostics.magnetic_nis = statistics.innovations == 0 ? 0.0 : statistics.innovation_sum / statistics.innovations;
  diagnostics.magnetic_residual_ut =
      statistics.components == 0 ? 0.0 : std::sqrt(statistics.residual_squared_sum / statistics.components);
  return result;
}

void KeyframeMeasurements::judge_field_error(const Keyframe& keyframe, const Pose& T_map_imu,
                                             const std::function<Vector3(int)>& bias_ut,
                                             const std::function<Matrix3(int)>& matrix,
                                             const SlidingWindow::ClockOffset& clock, FieldError& error) const {
  std::vector<FieldReading> readings;
  std::vector<Vector3> residuals_ut;
  for (const FieldReading& reading : keyframe.field_readings) {
    const Pose T_end_mag = reading.T_end_mag_at(clock.offset_s);
    const auto field = input_.field->query(T_map_imu * T_end_mag.position, input_.options.magnetic.interpolation);
    if (!field) continue;
    readings.push_back(reading);
    residuals_ut.push_back(calibrated_residual(T_map_imu, T_end_mag, reading.measured_ut, bias_ut(reading.magnetometer),
                                               matrix(reading.magnetometer), *field)
                               .residual_ut);
  }
  error.add(T_map_imu, readings, residuals_ut);
}

void KeyframeMeasurements::set_field(const KeyframeField& field, std::size_t k, SlidingWindow& window) const {
  if (field.pose) {
    window.set_field_pose(k, *field.pose, field.mask);
  } else {
    window.set_field(k, input_.field, input_.options.magnetic.interpolation, field.readings, field.mask);
  }
}

void KeyframeMeasurements::weigh_wheels(Keyframe& keyframe, const NavState& predicted, const Matrix17& covariance,
                                        const WheelCorrection& correction, WheelCalibrationSigmas sigmas) const {
  if (!input_.suite.wheels) return;
  keyframe.wheels = average_wheels(keyframe.wheel_samples, predicted, keyframe.imu, *input_.suite.wheels);
  if (!keyframe.wheels) return;
  keyframe.slip_jump = slip_jump(predicted, covariance, correction, sigmas, *keyframe.wheels);
  sigmas.slip_sigma = std::max(sigmas.slip_sigma, keyframe.slip_jump);
  keyframe.estimate.diagnostics.wheel_weight =
      lodestone::weigh_wheels(predicted, covariance, correction, sigmas, kWheelProbability, *keyframe.wheels);
}

void KeyframeMeasurements::set_wheels(const Keyframe& keyframe, const NavState& state, std::size_t k,
                                      SlidingWindow& window) const {
  if (!keyframe.wheels) return;
  WheelReading reading = *average_wheels(keyframe.wheel_samples, state, keyframe.imu, *input_.suite.wheels);
  reading.inverse_sigma_s_m = keyframe.wheels->inverse_sigma_s_m;
  window.set_wheels(k, reading, keyframe.slip_jump);
}

}  // namespace lodestone
