#pragma once

#include <cstdint>

namespace lodestone {

/// A point in time: nanoseconds since the log's epoch. Doubles are used for differences only, never for stamps.
using Time = std::int64_t;

/// A difference of two times in seconds.
constexpr double to_seconds(Time difference) {
  return static_cast<double>(difference) * 1e-9;
}

/// The limit of times, 127 years: the sum of two is still a Time.
constexpr Time farthest_time = 4'000'000'000'000'000'000;

/// Seconds to nanoseconds, rounded to the nearest. Beyond `farthest_time`, and for NaN, the result is `farthest_time`.
constexpr Time from_seconds(double seconds) {
  constexpr double farthest_s = 4e9;
  if (!(seconds < farthest_s)) return farthest_time;
  if (seconds < -farthest_s) return -farthest_time;
  return static_cast<Time>(seconds * 1e9 + (seconds >= 0.0 ? 0.5 : -0.5));
}

}  // namespace lodestone
