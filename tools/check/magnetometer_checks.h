#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Each magnetometer by its own readings: unit of the field, zeros, stuck, at its limit, spikes, noise.
Findings check_magnetometers(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
