#pragma once

#include <optional>
#include <vector>

#include "tools/check/log_sample.h"

namespace lodestone {

/// White noise of the sensors while the robot stands still. A value of 0 is unknown: too few samples, or constant ones.
struct StandstillNoise {
  double duration_s = 0.0;
  double gyroscope_density = 0.0;      ///< rad/s/√Hz
  double accelerometer_density = 0.0;  ///< m/s²/√Hz
  std::vector<double> fields_ut;       ///< one sigma per sample and component, µT; one per magnetometer
};

/// The calmest two seconds of the sample's IMU, if they are a standstill. For white noise, the standard deviation σ of
/// samples with the period Δt is the density times 1/√Δt, so that the density is σ √Δt (docs/design/051-init.md).
/// `period_s`: Δt. The accelerations must be in m/s².
std::optional<StandstillNoise> standstill_noise(const LogSample& sample, double period_s);

}  // namespace lodestone
