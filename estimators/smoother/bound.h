#pragma once

#include "core/geometry/trajectory.h"
#include "estimators/factory.h"

namespace lodestone {

/// The input of a smoother whose covariances are the Cramér-Rao bound (docs/design/030-cramer-rao-bound.md): everything
/// is linearized at the ground truth, nothing is solved, and all measurements have full weight: no masks, no β, no
/// Huber weights. Noise is as modelled, including the maps' errors. The causal, smoothed and best estimates bound those
/// of any unbiased estimator that uses the log up to that time, one lag further, and to its end. `truth` (T_map_imu)
/// must outlive the smoother; the prediction replaces poses that it lacks.
EstimatorInput bound_input(EstimatorInput input, const Trajectory& truth);

/// The state at `time`: pose and velocity from `truth`, the rest from `otherwise`. If `truth` has no pose at that time,
/// `otherwise`.
NavState state_at(const Trajectory& truth, Time time, const NavState& otherwise);

}  // namespace lodestone
