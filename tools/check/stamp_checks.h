#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Checks the stamps of each sensor: rate, gaps, silence at the begin or the end, stamps that are zero, go back, repeat
/// or jump, and an offset from the recorder's clock.
Findings check_stamps(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
