#pragma once

#include <functional>

#include "core/geometry/nav_state.h"

namespace lodestone {

/// Information of measurements about the pose at one linearization: Σ Jᵀ R⁻¹ J and Σ Jᵀ R⁻¹ r, tangent order φ, p.
struct PoseEvidence {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
};

/// Information of measurements about the whole state, in the order of namespace tangent.
struct StateEvidence {
  Matrix17 information = Matrix17::Zero();
  Vector17 gradient = Vector17::Zero();

  StateEvidence() = default;
  StateEvidence(const PoseEvidence& pose) {
    information.topLeftCorner<6, 6>() = pose.information;
    gradient.head<6>() = pose.gradient;
  }
};

struct IteratedUpdateLimits {
  int max_iterations = 4;
  double converged_m = 1e-3;
  double converged_rad = 2e-4;
};

struct UpdatedState {
  NavState state;
  Matrix17 covariance;
  int iterations = 0;
};

/// The iterated error-state Kalman update (eq:ieskf_update) in information form: minimizes
/// |x ⊟ x̂|²_{P⁻¹} + Σ r(x)² by Gauss-Newton, `evidence` relinearized at each iterate; P = (LᵀP̂⁻¹L + H)⁻¹ at the last,
/// L the Jacobian of ⊟. `prior`: x̂, `covariance`: P̂, positive definite.
UpdatedState iterated_update(const NavState& prior, const Matrix17& covariance,
                             const std::function<StateEvidence(const NavState&)>& evidence,
                             const IteratedUpdateLimits& limits);

}  // namespace lodestone
