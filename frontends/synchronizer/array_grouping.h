#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "core/measurements.h"

namespace lodestone {

/// Brings the readings of single magnetometers together to samples of the array: readings whose stamps lie within half
/// a sampling period of the earliest are one sample; a magnetometer that has none there is left empty.
class ArrayGrouping {
 public:
  explicit ArrayGrouping(std::size_t magnetometers) : queues_(magnetometers) {}

  /// False where the reading is of no magnetometer of the suite, or not later than the last one of its magnetometer.
  bool add(const MagneticSample& sample);

  /// Whether every magnetometer has passed `time` so far that no group at or before it can change any more.
  bool passed(Time time) const;

  /// The next group with a time up to `end`, if any; its time is the mean of its readings' stamps.
  std::optional<MagneticArraySample> take(Time end);

  /// Forgets readings at or before `time`; returns how many.
  int forget(Time time);

 private:
  Time half_period() const;

  std::vector<std::deque<MagneticSample>> queues_;
  mutable Time last_half_period_ = 0;  ///< while too few readings wait to tell
};

}  // namespace lodestone
