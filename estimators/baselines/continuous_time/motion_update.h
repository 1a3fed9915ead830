#pragma once

#include <functional>

#include "estimators/baselines/continuous_time/motion_state.h"

namespace lodestone {

/// Quadratic form of measurements around a state: information JᵀWJ and gradient JᵀWr.
struct MotionEvidence {
  Matrix15 information = Matrix15::Zero();
  Vector15 gradient = Vector15::Zero();
};

struct MotionUpdate {
  MotionState state;
  Matrix15 covariance;
  int iterations = 0;
};

/// The update of an iterated Kalman filter in information form: Gauss–Newton on the sum of prior and measurements.
/// `evidence`: of the measurements, linearized at the given state. Ends after `max_iterations`, or when no component of
/// a step exceeds 10⁻³ (SI units), as in the authors' program.
MotionUpdate update_motion(const MotionState& prior, const Matrix15& covariance,
                           const std::function<MotionEvidence(const MotionState&)>& evidence, int max_iterations);

}  // namespace lodestone
