#include "factors/condensed_lidar_factor.h"

#include <Eigen/Cholesky>

#include "factors/manifolds.h"

namespace lodestone {

void CondensedLidarFactor::set(const CondensedCost& cost, const PoseMask& mask) {
  cost_ = cost;
  root_ = cost.square_root();
  mask_ = mask;
}

void CondensedLidarFactor::set(const CondensedCost& cost, const PoseMask& mask, const Matrix6& common,
                               const Pose& T_map_imu) {
  set(cost, mask);
  const Matrix13x6 jacobian = root_ * cost_.coordinates_jacobian(T_map_imu);
  const Matrix13 covariance = Matrix13::Identity() + jacobian * common * jacobian.transpose();
  root_ = covariance.llt().matrixL().solve(root_);
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
