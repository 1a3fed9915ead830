#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "core/measurements.h"

namespace lodestone {

/// Groups the readings of single magnetometers to samples of the array: readings with stamps within half a sampling
/// period of the earliest form one sample. A magnetometer without such a reading is empty in the sample.
class ArrayGrouping {
 public:
  explicit ArrayGrouping(std::size_t magnetometers) : queues_(magnetometers) {}

  /// Returns false if the magnetometer is not in the suite, or if the reading is not later than the magnetometer's last
  /// one.
  bool add(const MagneticSample& sample);

  /// Whether the readings of all magnetometers are late enough that groups up to `time` are complete.
  bool passed(Time time) const;

  /// The next group with a time up to `end`, if any; its time is the mean of its readings' stamps.
  std::optional<MagneticArraySample> take(Time end);

  /// Discards readings at or before `time`; returns their number.
  int forget(Time time);

 private:
  Time half_period() const;

  std::vector<std::deque<MagneticSample>> queues_;
  mutable Time last_half_period_ = 0;  ///< used while too few readings are queued
};

}  // namespace lodestone
