// Variables of the window beside the states of its keyframes: calibration and map error.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/lidar/map_error.h"
#include "factors/manifolds.h"
#include "factors/sliding_window_parts.h"
#include "factors/sparse_information.h"

namespace lodestone {

namespace {

/// The map error is constant over this part of the path; its correlation length is the cube's edge.
constexpr double kMapErrorStep_m = kMapErrorCube_m / 5.0;

/// The error over tens of metres is constant over this share of its length.
constexpr double kLongErrorStep = 0.25;

constexpr int kMapErrorSize = 6;

}  // namespace

void SlidingWindow::add_calibration(WindowBlock& block, WindowFactor& prior, const std::vector<double>& sigmas) {
  if (prior) return;
  block.kind = BlockKind::euclidean;
  if (block.values.empty()) block.values.assign(sigmas.size(), 0.0);
  add_block(block);
  prior = add_factor(RandomWalkFactor::prior(sigmas), {&block});
}

bool SlidingWindow::add_imu_axes() {
  const double misalignment_rad = calibration_.imu.misalignment_sigma_deg * M_PI / 180.0;
  if (calibration_.imu.scale_sigma == 0.0 && misalignment_rad == 0.0) return false;
  std::vector<double> sigmas;
  for (int i = 0; i < 18; ++i) {
    sigmas.push_back(std::max(i % 9 % 4 == 0 ? calibration_.imu.scale_sigma : misalignment_rad, kHeldSigma));
  }
  add_calibration(imu_axes_, imu_axes_prior_, sigmas);
  return true;
}

ImuAxes SlidingWindow::imu_axes() const {
  return imu_axes_.values.empty() ? ImuAxes(ImuAxes::Zero()) : ImuAxes(imu_axes_.values.data());
}

SlidingWindow::ClockOffset SlidingWindow::clock_offset() const {
  const double sigma_s = calibration_.magnetometers.clock_sigma_s;
  if (!clock_prior_) return {0.0, sigma_s};
  return {clock_.values[0], clock_sigma_s_ > 0.0 ? clock_sigma_s_ : sigma_s};
}

LidarCorrection SlidingWindow::lidar_correction() const {
  if (lidar_calibration_.values.empty()) return {};
  const double* values = lidar_calibration_.values.data();
  return {Vector3(values), Vector3(values + 3), values[6]};
}

SlidingWindow::MapErrorEpoch* SlidingWindow::map_error_epoch_at(const Vector3& position, const CondensedScan& scan) {
  double way_m = 0.0;
  if (!map_errors_.empty()) {
    way_m = (position - map_errors_.back()->start).norm();
    if (way_m < kMapErrorStep_m) return map_errors_.back().get();
  }
  auto epoch = std::make_unique<MapErrorEpoch>();
  epoch->start = position;
  epoch->error = {BlockKind::euclidean, std::vector<double>(kMapErrorSize, 0.0)};
  add_block(epoch->error);
  if (map_errors_.empty()) {
    epoch->step = add_factor(std::make_unique<GaussMarkovFactor>(scan.map_error_root, 0.0), {&epoch->error});
  } else {
    MapErrorEpoch& before = *map_errors_.back();
    const double decay = std::exp(-way_m / kMapErrorCube_m);
    for (std::size_t i = 0; i < epoch->error.values.size(); ++i)
      epoch->error.values[i] = decay * before.error.values[i];
    epoch->step =
        add_factor(std::make_unique<GaussMarkovFactor>(scan.map_error_root, decay), {&before.error, &epoch->error});
    // In steps, which are fewer for longer correlation lengths.
    const double long_way_m = before.long_way_m + way_m;
    const bool steps = long_way_m >= kLongErrorStep * scan.long_map_error_length_m;
    epoch->long_decay = steps ? std::exp(-long_way_m / scan.long_map_error_length_m) : 1.0;
    epoch->long_way_m = steps ? 0.0 : long_way_m;
  }
  map_errors_.push_back(std::move(epoch));
  return map_errors_.back().get();
}

// Central differences over both neighbours: unlike one-sided rates, they are not correlated with the noise of the
// keyframe's own scan and IMU, which the clock of the LiDAR would otherwise explain (docs/design/041).
void SlidingWindow::renew_rates(std::size_t k) {
  KeyframeFactors& keyframe = *keyframes_[k];
  const bool has_next = k + 1 < keyframes_.size();
  const std::optional<NavState> before = k > 0 ? std::optional(state(k - 1)) : std::nullopt;
  const std::optional<NavState> after = has_next ? std::optional(state(k + 1)) : std::nullopt;
  const double span_s = to_seconds(keyframes_[has_next ? k + 1 : k]->time - keyframes_[k > 0 ? k - 1 : k]->time);
  // The oldest keyframe keeps its rates from the time when it had a previous keyframe.
  if (span_s > 0.0 && (k > 0 || keyframe.samples.empty())) {
    keyframe.rates = rates_between(before ? &*before : nullptr, state(k), after ? &*after : nullptr, span_s);
  }
  if (keyframe.lidar) {
    keyframe.lidar.change().set_rates(keyframe.rates, k > 0 ? keyframes_[k - 1]->rates : MotionRates{});
  }
  if (has_next && keyframes_[k + 1]->lidar) {
    KeyframeFactors& next = *keyframes_[k + 1];
    next.lidar.change().set_rates(next.rates, keyframe.rates);
  }
}

void SlidingWindow::remove_lidar(KeyframeFactors& keyframe) {
  remove_factor(keyframe.lidar);
  if (keyframe.map_error != nullptr) --keyframe.map_error->keyframes;
  keyframe.map_error = nullptr;
}

Pose SlidingWindow::seen_pose(std::size_t k) const {
  const KeyframeFactors& keyframe = *keyframes_[k];
  const Pose T_map_imu = to_pose(keyframe.pose.values.data());
  return keyframe.lidar ? keyframe.lidar.content().seen(T_map_imu, lidar_values(), map_error_values(keyframe)).pose
                        : T_map_imu;
}

Vector6 SlidingWindow::map_error(std::size_t k) const {
  const MapErrorEpoch* epoch = keyframes_[k]->map_error;
  if (epoch == nullptr && !map_errors_.empty()) epoch = map_errors_.back().get();
  return epoch == nullptr ? Vector6::Zero().eval() : Vector6(epoch->error.values.data());
}

const double* SlidingWindow::lidar_values() const {
  return lidar_calibration_prior_ ? lidar_calibration_.values.data() : nullptr;
}

const double* SlidingWindow::map_error_values(const KeyframeFactors& keyframe) {
  return keyframe.map_error != nullptr ? keyframe.map_error->error.values.data() : nullptr;
}

Matrix3 SlidingWindow::magnetometer_matrix(int magnetometer) const {
  if (matrices_.empty()) return Matrix3::Zero();
  const std::vector<double>& values = matrices_[static_cast<std::size_t>(magnetometer)].values;
  return values.empty() ? Matrix3::Zero().eval() : CalibrationEstimate::matrix_of(values.data());
}

void SlidingWindow::set_calibration(const CalibrationEstimate& estimate) {
  changed();
  const LidarCorrection& lidar = estimate.lidar.correction;
  lidar_calibration_.values.assign(7, 0.0);
  Eigen::Map<Eigen::Matrix<double, 7, 1>>(lidar_calibration_.values.data()) << lidar.turn_rad, lidar.shift_m,
      lidar.clock_s;
  imu_axes_.values.assign(estimate.imu.axes.begin(), estimate.imu.axes.end());
  clock_.values.assign(1, estimate.magnetometer_clock_s);
  const WheelCorrection& wheels = estimate.wheels.correction;
  wheel_calibration_.values = {wheels.scale, wheels.turn_rad.x(), wheels.turn_rad.y(), wheels.turn_rad.z()};
  matrices_.resize(estimate.magnetometers.size());
  for (std::size_t i = 0; i < matrices_.size(); ++i) {
    matrices_[i].values.resize(CalibrationEstimate::kMatrixParameters);
    Eigen::Map<Vector9>(matrices_[i].values.data()) << estimate.magnetometers[i].turn_rad,
        estimate.magnetometers[i].distortion;
  }
}

CalibrationEstimate SlidingWindow::calibration_estimate() const {
  CalibrationEstimate result;
  const SparseInformation& known = information();
  const auto joint_sigmas = [&](std::span<const WindowBlock* const> blocks) -> Eigen::VectorXd {
    return covariance(known, blocks).diagonal().cwiseMax(0.0).cwiseSqrt();
  };
  const auto sigmas = [&](const WindowBlock& block) { return joint_sigmas(std::array<const WindowBlock*, 1>{&block}); };
  if (lidar_calibration_prior_) {
    const Eigen::VectorXd sigma = sigmas(lidar_calibration_);
    result.lidar = {lidar_correction(), sigma.head<3>(), sigma.segment<3>(3), sigma[6]};
  }
  if (imu_axes_prior_) result.imu = {imu_axes(), sigmas(imu_axes_)};
  result.magnetometers.resize(static_cast<std::size_t>(magnetometers_));
  std::vector<const WindowBlock*> estimated;
  for (std::size_t i = 0; i < matrices_priors_.size(); ++i) {
    if (matrices_priors_[i]) estimated.push_back(&matrices_[i]);
  }
  if (!estimated.empty()) {
    const Eigen::VectorXd sigma = joint_sigmas(estimated);
    Eigen::Index first = 0;
    for (std::size_t i = 0; i < matrices_priors_.size(); ++i) {
      if (!matrices_priors_[i]) continue;
      const double* values = matrices_[i].values.data();
      result.magnetometers[i] = {Vector3(values), sigma.segment<3>(first), Eigen::Map<const Vector6>(values + 3),
                                 sigma.segment<6>(first + 3)};
      first += CalibrationEstimate::kMatrixParameters;
    }
  }
  if (wheel_calibration_prior_) {
    const Eigen::VectorXd sigma = sigmas(wheel_calibration_);
    const double* values = wheel_calibration_.values.data();
    result.wheels = {{values[0], Vector3(values + 1)}, sigma[0], sigma.tail<3>()};
  }
  if (clock_prior_) {
    result.magnetometer_clock_s = clock_.values[0];
    result.magnetometer_clock_sigma_s = sigmas(clock_)[0];
  }
  return result;
}

}  // namespace lodestone
