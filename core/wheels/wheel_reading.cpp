#include "core/wheels/wheel_reading.h"

#include <algorithm>
#include <cmath>

#include "core/imu/integration.h"

namespace lodestone {

namespace {

// Encoders of wheels at rest report exactly zero; drivers may add rounding.
constexpr double kStandstill_m_s = 1e-3;
constexpr double kStandstill_rad_s = 1e-3;

/// Of the velocity of a robot whose wheels stand still: vibration, elastic suspension.
constexpr double kStandstillSigma_m_s = 0.005;

bool stands_still(const WheelSample& sample) {
  return std::abs(sample.forward_velocity_m_s) <= kStandstill_m_s &&
         std::abs(sample.lateral_velocity_m_s) <= kStandstill_m_s &&
         std::abs(sample.yaw_rate_rad_s) <= kStandstill_rad_s;
}

/// Adds the motion of the wheel frame at `sample.time`, relative to the state at t_k.
void add_motion(const WheelSample& sample, const ImuInterval& interval, const NavState& end, const Pose& T_map_imu,
                const Vector3& velocity, const WheelModel& model, WheelReading& sum) {
  const Quaternion R_wheels_imu = model.T_imu_wheels.rotation.conjugate();
  const Quaternion R_t_end = T_map_imu.rotation.conjugate() * end.T_map_imu.rotation;
  const Matrix3 turn = (R_wheels_imu * R_t_end).toRotationMatrix();
  const Vector3 change = end.T_map_imu.rotation.conjugate() * (velocity - end.velocity);
  const Vector3 rate = interval.angular_velocity + end.gyroscope_bias;  // as measured
  const Vector3& lever = model.T_imu_wheels.position;
  sum.by_velocity += turn;
  sum.by_gyroscope_bias += R_wheels_imu.toRotationMatrix() * so3::hat(lever);  // −b × l = l × b
  sum.rest += turn * change + R_wheels_imu * rate.cross(lever);
  sum.measured_m_s += Vector3(sample.forward_velocity_m_s, sample.lateral_velocity_m_s, 0.0);
  ++sum.samples;
}

void set_sigmas(const WheelModel& model, WheelReading& reading) {
  if (reading.standstill) {
    reading.measured_m_s.setZero();
    reading.inverse_sigma_s_m.setConstant(1.0 / kStandstillSigma_m_s);
    return;
  }
  const double measured = std::sqrt(static_cast<double>(reading.samples)) / model.velocity_sigma_m_s;
  reading.inverse_sigma_s_m = Vector3(measured, 0.0, 0.0);
  switch (model.lateral_motion) {
    case LateralMotion::unknown:
      reading.measured_m_s.y() = 0.0;
      break;
    case LateralMotion::measured:
      reading.inverse_sigma_s_m.y() = measured;
      break;
    case LateralMotion::none:
      reading.measured_m_s.y() = 0.0;
      // Side slip in curves lasts longer than a scan: its sigma does not fall with the number of samples.
      reading.inverse_sigma_s_m.tail<2>().setConstant(1.0 / model.lateral_sigma_m_s);
      break;
  }
}

}  // namespace

std::optional<WheelReading> average_wheels(std::span<const WheelSample> samples, const NavState& end,
                                           std::span<const ImuSample> imu, const WheelModel& model) {
  if (samples.empty() || imu.size() < 2) return std::nullopt;
  WheelReading result;
  Pose T_map_imu = end.T_map_imu;
  Vector3 velocity = end.velocity;
  auto sample = samples.rbegin();
  for (std::size_t i = imu.size() - 1; i > 0 && sample != samples.rend(); --i) {
    const ImuInterval interval = make_interval(imu[i - 1], imu[i], end.gyroscope_bias, end.accelerometer_bias);
    // Samples before the first IMU sample are related to the state through the first interval.
    for (; sample != samples.rend() && (sample->time > imu[i - 1].time || i == 1); ++sample) {
      Pose at = T_map_imu;
      Vector3 velocity_at = velocity;
      const double before_s = std::max(0.0, to_seconds(imu[i].time - sample->time));
      if (interval.duration_s > 0.0) integrate(interval, end.gravity, -before_s / interval.duration_s, at, velocity_at);
      add_motion(*sample, interval, end, at, velocity_at, model, result);
    }
    integrate(interval, end.gravity, -1.0, T_map_imu, velocity);
  }
  if (result.samples == 0) return std::nullopt;
  const double count = result.samples;
  result.measured_m_s /= count;
  result.by_velocity /= count;
  result.by_gyroscope_bias /= count;
  result.rest /= count;
  result.standstill = std::ranges::all_of(samples, stands_still);
  set_sigmas(model, result);
  return result;
}

}  // namespace lodestone
