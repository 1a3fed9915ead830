#pragma once

#include <cstdint>

#include "core/time.h"
#include "core/warnings.h"

namespace lodestone {

/// Where a pass over a log stands, beside its estimator and what its sink was told.
struct PassState {
  std::int64_t scans = 0;
  Time last_end = 0;         ///< of the last scan
  double wall_s = 0.0;       ///< spent so far
  double peak_rss_mb = 0.0;  ///< so far
  WarningLog warnings;
};

}  // namespace lodestone
