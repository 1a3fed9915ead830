#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Compares wheel odometry with the IMU: direction and unit of the velocity with the specific force, the clock with the
/// turn rate. Nothing is found if the robot does not accelerate or turn enough.
Findings check_wheels(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
