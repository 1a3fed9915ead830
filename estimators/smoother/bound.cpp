#include "estimators/smoother/bound.h"

namespace lodestone {

namespace {

constexpr Time kLongestGap = 200'000'000;
constexpr Time kHalfSpan = 20'000'000;  // of the differences that give the velocity

}  // namespace

EstimatorInput bound_input(EstimatorInput input, const Trajectory& truth) {
  input.linearize_at = &truth;
  input.options.smoother.refine = Refinement::batch;
  input.options.degeneracy.rule = DegeneracyRule::none;
  input.options.magnetic.shrink = MagneticShrink::none;
  input.options.magnetic.huber = false;
  return input;
}

NavState state_at(const Trajectory& truth, Time time, const NavState& otherwise) {
  NavState result = otherwise;
  const auto pose = interpolate(truth, time, kLongestGap);
  if (!pose) return result;
  result.T_map_imu = *pose;
  const auto before = interpolate(truth, time - kHalfSpan, kLongestGap);
  const auto after = interpolate(truth, time + kHalfSpan, kLongestGap);
  const Time span = (before ? kHalfSpan : 0) + (after ? kHalfSpan : 0);
  if (span > 0) {
    result.velocity = (after.value_or(*pose).position - before.value_or(*pose).position) / to_seconds(span);
  }
  return result;
}

}  // namespace lodestone
