#include "estimators/health/motion_check.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr double kCompared_s = 10.0;
constexpr double kLongestStep_s = 1.5;  // a LiDAR at 1 Hz, whose stamps jitter
constexpr double kSigmas = 4.0;

}  // namespace

void MotionCheck::add(const Estimate& estimate) {
  const NavState& state = estimate.state;
  Passed next{estimate.time, state.T_map_imu.position, state.velocity, Vector3::Zero(),
              position_variance_m2(estimate.covariance)};
  if (!passed_.empty()) {
    const Passed& last = passed_.back();
    const double step_s = to_seconds(next.time - last.time);
    if (step_s > kLongestStep_s) {
      passed_.clear();
    } else {
      next.carried = last.carried + 0.5 * step_s * (last.velocity + next.velocity);
    }
  }
  passed_.push_back(next);
  while (to_seconds(next.time - passed_.front().time) > kCompared_s) passed_.pop_front();
}

double MotionCheck::apart_m() const {
  if (passed_.size() < 2) return 0.0;
  const Passed& from = passed_.front();
  const Passed& to = passed_.back();
  const double apart_m = ((to.position - from.position) - (to.carried - from.carried)).norm();
  double variance_m2 = 0.0;
  for (const Passed& passed : passed_) variance_m2 = std::max(variance_m2, passed.variance_m2);
  return apart_m > kSigmas * std::sqrt(2.0 * variance_m2) ? apart_m : 0.0;
}

}  // namespace lodestone
