#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Checks the clouds alone: missing fields, point times (absent, all equal, wrong unit, longer or shorter than the
/// scan), scans without points, and scans with few points within the platform's ranges.
Findings check_scans(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
