#include "factors/condensed_lidar_factor.h"

#include "factors/manifolds.h"

namespace lodestone {

void CondensedLidarFactor::set(const CondensedCost& cost, const PoseMask& mask) {
  cost_ = cost;
  root_ = cost.square_root();
  mask_ = mask;
}

bool CondensedLidarFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Matrix6 seen_by_pose;
  const bool derive = jacobians != nullptr && jacobians[0] != nullptr;
  const Pose seen = mask_.apply(to_pose(parameters[0]), derive ? &seen_by_pose : nullptr);
  Eigen::Map<Vector13>{residuals} = root_ * cost_.coordinates(seen);
  if (derive) {
    Matrix13x6 jacobian = root_ * cost_.coordinates_jacobian(seen);
    if (mask_.active()) jacobian = (jacobian * seen_by_pose).eval();
    to_ambient(parameters[0], jacobian, jacobians[0]);
  }
  return true;
}

}  // namespace lodestone
