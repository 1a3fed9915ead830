#pragma once

#include "frontends/configuration/sensor_choice.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

/// Checks of each kind of sensor alone.
namespace lodestone {

/// Reports topics of the platform that are missing or have another type, with the best topic of the log; topics of
/// known types that the platform does not use; and messages that cannot be decoded. A missing topic that is not
/// `needed` is a note.
Findings check_topics(const LogSample& sample, const Platform& platform, SensorChoice needed = {});

/// Checks the stamps of each sensor: rate, gaps, silence at the begin or the end, stamps that are zero, go back, repeat
/// or jump, and an offset from the recorder's clock.
Findings check_stamps(const LogSample& sample, const Platform& platform);

/// Checks the clouds alone: missing fields, point times (absent, all equal, wrong unit, longer or shorter than the
/// scan), scans without points, and scans with few points within the platform's ranges.
Findings check_scans(const LogSample& sample, const Platform& platform);

/// Checks each magnetometer alone: unit of the field, zeros, stuck values, saturation, spikes, noise.
Findings check_magnetometers(const LogSample& sample, const Platform& platform);

/// Compares wheel odometry with the IMU: direction and unit of the velocity with the specific force, the clock with the
/// turn rate. Nothing is found if the robot does not accelerate or turn enough.
Findings check_wheels(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
