#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Checks each magnetometer alone: unit of the field, zeros, stuck values, saturation, spikes, noise.
Findings check_magnetometers(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
