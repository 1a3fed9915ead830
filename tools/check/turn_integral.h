#pragma once

#include <optional>
#include <vector>

#include "core/measurements.h"

namespace lodestone {

/// The gyroscope's readings summed over time, so that the turn over any interval is a difference. Over a tenth of a
/// second the order of turns about different axes does not matter here.
class TurnIntegral {
 public:
  /// `imu`: strictly increasing stamps.
  explicit TurnIntegral(const std::vector<ImuSample>& imu);

  /// Rotation vector (rad, imu frame) from `begin` to `end`; nothing outside the samples or across a gap of them.
  std::optional<Vector3> over(Time begin, Time end) const;

 private:
  struct Place {
    std::size_t index;
    double share;
  };
  std::optional<Place> place_of(Time time) const;

  std::vector<Time> times_;
  std::vector<Vector3> sums_;
  std::vector<int> gaps_;  ///< before each sample
};

}  // namespace lodestone
