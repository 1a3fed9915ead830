#pragma once

#include <cstdint>

namespace lodestone {

/// A point in time: nanoseconds since the log's epoch. Doubles are used for differences only, never for stamps.
using Time = std::int64_t;

/// A difference of two times in seconds.
constexpr double to_seconds(Time difference) { return static_cast<double>(difference) * 1e-9; }

/// Seconds to nanoseconds, rounded to the nearest.
constexpr Time from_seconds(double seconds) {
  return static_cast<Time>(seconds * 1e9 + (seconds >= 0.0 ? 0.5 : -0.5));
}

}  // namespace lodestone
