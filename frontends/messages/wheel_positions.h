#pragma once

#include <cmath>
#include <optional>

#include "core/time.h"

namespace lodestone {

/// Velocities of two wheels from their positions, as encoders count them.
class WheelPositions {
 public:
  struct Side {
    double position = 0.0;
    double period = 0.0;  ///< a counter begins anew after so many units; 0: it does not
  };
  struct Velocities {
    Time time = 0;                   ///< the middle of the interval
    double left = 0.0, right = 0.0;  ///< units of the positions a second
  };

  /// Mean velocities since the message before. Empty for the first message, after a pause of more than half a second,
  /// and if the time did not grow. The same time again gives the same result.
  std::optional<Velocities> add(Time time, const Side& left, const Side& right) {
    if (known_ && time == time_) return velocities_;
    const double step_s = to_seconds(time - time_);
    velocities_.reset();
    if (known_ && step_s > 0.0 && step_s <= kLongest_s) {
      velocities_ = {time_ + (time - time_) / 2, way(left_, left) / step_s, way(right_, right) / step_s};
    }
    known_ = true;
    time_ = time;
    left_ = left.position;
    right_ = right.position;
    return velocities_;
  }

 private:
  static constexpr double kLongest_s = 0.5;

  static double way(double before, const Side& now) {
    const double way = now.position - before;
    return now.period > 0.0 ? std::remainder(way, now.period) : way;
  }

  bool known_ = false;
  Time time_ = 0;
  double left_ = 0.0, right_ = 0.0;
  std::optional<Velocities> velocities_;
};

}  // namespace lodestone
