#pragma once

#include <span>

#include "core/geometry/nav_state.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Forward propagation of the state from the first sample's time to the last one's (eq:forward_propagation, corrected:
/// R in the velocity row). If given, `covariance` (17×17, tangent order φ, p, v, b_g, b_a, g) is propagated as well:
/// P ← F P Fᵀ + F_w Q F_wᵀ, with the noise densities of `noise`.
NavState propagate(const NavState& start, std::span<const ImuSample> samples, const ImuNoise& noise,
                   Matrix17* covariance);

}  // namespace lodestone
