#pragma once

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Whether the messages of each sensor come as the platform says and as regularly as they should: rates, gaps, silence
/// at the begin or the end, stamps that are zero, go back, repeat or leap, and stamps of another clock than the
/// recorder's.
Findings check_stamps(const LogSample& sample, const Platform& platform);

}  // namespace lodestone
