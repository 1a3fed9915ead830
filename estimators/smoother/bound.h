#pragma once

#include "core/geometry/trajectory.h"
#include "estimators/factory.h"

namespace lodestone {

/// The input of a smoother whose covariances are the Cramér-Rao bound: everything is linearized at the true trajectory,
/// nothing is solved, and what the sensors tell counts in full: no masks, no β, no Huber weights. Noise is as the
/// models say, errors of the maps included. Its causal, smoothed and best estimates bound those of any unbiased
/// estimator that knows the log up to then, one lag further, and to its end. `truth` (T_map_imu) must outlive the
/// smoother; where it has no pose the prediction takes its place.
EstimatorInput bound_input(EstimatorInput input, const Trajectory& truth);

/// The state at `time`: pose and velocity of `truth`, the rest of `otherwise`; `otherwise` where `truth` has none.
NavState state_at(const Trajectory& truth, Time time, const NavState& otherwise);

}  // namespace lodestone
