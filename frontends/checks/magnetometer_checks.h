#pragma once

#include "frontends/checks/finding.h"
#include "frontends/checks/log_sample.h"

namespace lodestone {

/// Each magnetometer by its own readings: unit of the field, zeros, stuck, at its limit, spikes, noise.
Findings check_magnetometers(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
