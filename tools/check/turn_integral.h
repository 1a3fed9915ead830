#pragma once

#include <optional>
#include <vector>

#include "core/measurements.h"

namespace lodestone {

/// The sum of the gyroscope's readings over time: the rotation in an interval is a difference. The order of rotations
/// is neglected, which is accurate over a tenth of a second.
class TurnIntegral {
 public:
  /// `imu`: strictly increasing stamps.
  explicit TurnIntegral(const std::vector<ImuSample>& imu);

  /// Rotation vector (rad, imu frame) from `begin` to `end`. Nothing outside the samples or across a gap.
  std::optional<Vector3> over(Time begin, Time end) const;

 private:
  std::vector<Time> times_;
  std::vector<Vector3> sums_;
  std::vector<int> gaps_;  ///< number of gaps before each sample
};

}  // namespace lodestone
