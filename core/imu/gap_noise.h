#pragma once

#include "core/sensor_suite.h"

namespace lodestone {

/// Number of sampling periods of the IMU without a sample that are no gap: a few lost packets.
inline constexpr double kImuGapPeriods = 5.0;

/// `noise` of samples that were interpolated over a gap of the IMU of `gap_s`: besides what it states, white noise with
/// the variance that a random motion adds over the gap (docs/design/062-gaps-of-the-imu.md). Unchanged for up to
/// kImuGapPeriods.
ImuNoise with_gap(const ImuNoise& noise, double gap_s);

}  // namespace lodestone
