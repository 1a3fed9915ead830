#include "factors/wheel_factor.h"

#include "factors/manifolds.h"
#include "factors/row_major.h"

namespace lodestone {

bool WheelFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Pose T_map_imu = to_pose(parameters[0]);
  const WheelCorrection correction{parameters[2][0] + parameters[3][0], Vector3(parameters[2] + 1)};
  const WheelResidual residual =
      wheel_residual(reading_, T_map_imu.rotation, Vector3(parameters[1]), Vector3(parameters[1] + 3), correction);
  Eigen::Map<Vector3>{residuals} = residual.value;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, 3, 6> by_pose = Eigen::Matrix<double, 3, 6>::Zero();
    by_pose.leftCols<3>() = residual.by_rotation;
    to_ambient(parameters[0], by_pose, jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    row_major<3, 9>(jacobians[1]) << residual.by_velocity, residual.by_gyroscope_bias, Matrix3::Zero();
  }
  if (jacobians[2] != nullptr) row_major<3, kWheelParameters>(jacobians[2]) = residual.by_calibration;
  if (jacobians[3] != nullptr) {
    Eigen::Map<Vector3> by_slip(jacobians[3]);
    by_slip = residual.by_calibration.col(0);
  }
  return true;
}

}  // namespace lodestone
