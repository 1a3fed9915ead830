#pragma once

#include <deque>

#include "estimators/estimate.h"

namespace lodestone {

/// Compares how far the positions of the last ten seconds moved with how far their own velocities carried them. An
/// estimator that puts its pose back at each scan stands while its robot drives: each step may be within its
/// covariance, their sum is not (docs/design/050-health.md).
class MotionCheck {
 public:
  /// The newest estimate, in order of time. Begins anew after more than a second without one.
  void add(const Estimate& estimate);

  void restart() { passed_.clear(); }

  /// Distance between both ways, in metres. 0 if it is no more than the covariances of this time allow.
  double apart_m() const;

 private:
  struct Passed {
    Time time = 0;
    Vector3 position = Vector3::Zero();
    Vector3 velocity = Vector3::Zero();
    Vector3 carried = Vector3::Zero();  // integral of the velocity since the first estimate
    double variance_m2 = 0.0;           // of the position's worst axis
  };
  std::deque<Passed> passed_;
};

}  // namespace lodestone
