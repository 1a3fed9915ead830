#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/measurements.h"
#include "frontends/synchronizer/synchronizer.h"

namespace lodestone {

/// Makes a bundle within a log the first of one: it has only the measurements from its scan's start on.
inline void begin_log_with(ScanBundle& first) {
  const auto is_before = [&](const auto& sample) { return sample.time < first.scan.start; };
  std::erase_if(first.imu, is_before);
  std::erase_if(first.magnetic, is_before);
}

/// NaN without values.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace lodestone
