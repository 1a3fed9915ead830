#pragma once

#include <optional>

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// The calmest half second of an IMU.
struct RestSpan {
  Time begin = 0;
  Time end = 0;
  Vector3 angular_velocity = Vector3::Zero();     ///< mean, rad/s, imu frame
  Vector3 linear_acceleration = Vector3::Zero();  ///< mean, m/s²
  double gyroscope_noise = 0.0;                   ///< sigma per sample and axis, from differences of neighbours, rad/s
  double accelerometer_noise = 0.0;               ///< the same, m/s²
  double shaking_m_s2 = 0.0;  ///< standard deviation of the acceleration: noise, vibration and motion
  bool at_rest = false;       ///< neither noise nor motion contradicts standstill
};

/// Nothing if there is less than half a second of samples.
std::optional<RestSpan> calmest_span(const std::vector<ImuSample>& imu);

/// Checks units of acceleration and turn rate, the magnitude of gravity, the gyroscope's bias at rest, and noise
/// against the platform file.
Findings check_imu(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
