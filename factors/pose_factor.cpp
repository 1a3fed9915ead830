#include "factors/pose_factor.h"

#include "factors/manifolds.h"

namespace lodestone {

void PoseFactor::set(const MeasuredPose& measured, const PoseMask& mask) {
  measured_ = measured;
  mask_ = mask;
}

bool PoseFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Matrix6 seen_by_pose;
  const bool derive = jacobians != nullptr && jacobians[0] != nullptr;
  const Pose seen = mask_.apply(to_pose(parameters[0]), derive ? &seen_by_pose : nullptr);
  const Vector6 difference = seen.boxminus(measured_.T_map_imu);
  Eigen::Map<Vector6>{residuals} = measured_.root * difference;
  if (derive) {
    Matrix6 jacobian = measured_.root;
    jacobian.leftCols<3>() = (jacobian.leftCols<3>() * so3::right_jacobian_inverse(difference.head<3>())).eval();
    to_ambient(parameters[0], jacobian * seen_by_pose, jacobians[0]);
  }
  return true;
}

}  // namespace lodestone
