#pragma once

#include <algorithm>

namespace lodestone {

/// Cubic Hermite polynomials over a step, as functions of the time before its end. If acceleration is white noise, and
/// position and velocity are known at both ends of the step, the mean path is this cubic (the Gaussian-process motion
/// prior of Barfoot, State Estimation for Robotics, section 11.1).
struct Hermite {
  /// `age_s`: time before the end; within the step.
  Hermite(double age_s, double step_s) : share(std::clamp(age_s / step_s, 0.0, 1.0)) {
    const double rest = 1.0 - share;
    near_slope = step_s * share * rest * rest;
    far_position = share * share * (3.0 - 2.0 * share);
    far_slope = -step_s * share * share * rest;
  }

  double share;         ///< age over step, from 0 to 1
  double near_slope;    ///< s, of the slope by age at the end (age 0)
  double far_position;  ///< of the position at the beginning (age of a step)
  double far_slope;     ///< s, of the slope by age at the beginning
};

}  // namespace lodestone
