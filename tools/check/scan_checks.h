#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// The clouds by themselves: fields that are missing, each point's time (absent, all equal, another unit, longer or
/// shorter than the scan), scans without points or with hardly any within the platform's ranges.
Findings check_scans(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
