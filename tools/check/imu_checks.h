#pragma once

#include <optional>

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// The calmest part of an IMU's samples.
struct RestSpan {
  Time begin = 0;
  Time end = 0;
  Vector3 angular_velocity = Vector3::Zero();     ///< mean, rad/s, imu frame
  Vector3 linear_acceleration = Vector3::Zero();  ///< mean, m/s²
  double gyroscope_noise = 0.0;                   ///< sigma per sample and axis, from differences of neighbours, rad/s
  double accelerometer_noise = 0.0;               ///< the same, m/s²
  double shaking_m_s2 = 0.0;   ///< standard deviation of the acceleration: noise, vibration and motion
  double shaking_rad_s = 0.0;  ///< standard deviation of the turn rate, the same
  bool at_rest = false;        ///< neither noise nor motion contradicts standstill
};

/// The calmest span of this length. Nothing if the samples are shorter.
std::optional<RestSpan> calmest_span(const std::vector<ImuSample>& imu, Time length = 500'000'000);

/// Checks units of acceleration and turn rate, the magnitude of gravity, the gyroscope's bias at rest, and noise
/// against the platform file.
Findings check_imu(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
