#include "factors/preintegration_factor.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "factors/manifolds.h"

namespace lodestone {

Vector6 axes_shown_after(const Preintegration& motion) {
  constexpr double kSigmas = 10.0;
  const Preintegration::Increment increment =
      motion.corrected(motion.gyroscope_bias(), motion.accelerometer_bias(), motion.axes());
  Vector6 moved;
  moved << so3::log(increment.rotation), increment.velocity;
  Vector6 variance;
  variance << motion.covariance().diagonal().head<3>(), motion.covariance().diagonal().tail<3>();
  const Vector6 squares = moved.cwiseAbs2();
  return squares.cwiseQuotient(squares + kSigmas * kSigmas * variance);
}

void PreintegrationFactor::set(const Preintegration& preintegration, const ImuNoise& noise) {
  preintegration_ = preintegration;
  const Eigen::LLT<Matrix9> factor(preintegration.covariance());
  whitening_ = factor.matrixL().solve(Matrix9::Identity());
  const double root_duration = std::sqrt(preintegration.duration_s());
  gyroscope_bias_whitening_ = 1.0 / (noise.gyroscope_bias_random_walk * root_duration);
  accelerometer_bias_whitening_ = 1.0 / (noise.accelerometer_bias_random_walk * root_duration);
}

Vector15 PreintegrationFactor::residual(const NavState& first, const NavState& second, const ImuAxes& axes,
                                        Jacobians* jacobians) const {
  const double duration = preintegration_.duration_s();
  const Preintegration::Increment increment =
      preintegration_.corrected(first.gyroscope_bias, first.accelerometer_bias, axes);
  const Matrix3 rotation_back = first.T_map_imu.rotation.toRotationMatrix().transpose();
  const Vector3 moved = second.T_map_imu.position - first.T_map_imu.position - duration * first.velocity -
                        0.5 * duration * duration * first.gravity;
  const Vector3 accelerated = second.velocity - first.velocity - duration * first.gravity;
  const Vector3 rotation_error =
      so3::log(increment.rotation.conjugate() * first.T_map_imu.rotation.conjugate() * second.T_map_imu.rotation);
  Vector9 error;
  error.head<3>() = rotation_error;
  error.segment<3>(3) = rotation_back * moved - increment.position;
  error.tail<3>() = rotation_back * accelerated - increment.velocity;

  // The readings' noise is that of the sensors, not of the readings divided by 1 + E.
  using Matrix3RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Matrix9 to_readings = Matrix9::Identity();
  to_readings.topLeftCorner<3, 3>() += Eigen::Map<const Matrix3RowMajor>(axes.data());
  to_readings.block<3, 3>(3, 3) += Eigen::Map<const Matrix3RowMajor>(axes.data() + 9);
  to_readings.block<3, 3>(6, 6) = to_readings.block<3, 3>(3, 3);
  const Matrix9 whitening = whitening_ * to_readings;

  Vector15 result;
  result.head<9>() = whitening * error;
  result.segment<3>(9) = gyroscope_bias_whitening_ * (second.gyroscope_bias - first.gyroscope_bias);
  result.tail<3>() = accelerometer_bias_whitening_ * (second.accelerometer_bias - first.accelerometer_bias);
  if (jacobians == nullptr) return result;

  using namespace tangent;
  const Matrix3 error_jacobian = so3::right_jacobian_inverse(rotation_error);
  const Matrix3 turned = (second.T_map_imu.rotation.conjugate() * first.T_map_imu.rotation).toRotationMatrix();
  const Vector3 bias_turn =
      preintegration_.rotation_by_gyroscope_bias() * (first.gyroscope_bias - preintegration_.gyroscope_bias()) +
      preintegration_.by_axes().topRows<3>() * (axes - preintegration_.axes());
  const Matrix3 by_turn =
      -error_jacobian * so3::exp(-rotation_error).toRotationMatrix() * so3::right_jacobian(bias_turn);
  Matrix15& by_first = jacobians->by_first;
  Matrix15& by_second = jacobians->by_second;
  by_first.block<3, 3>(0, tangent::rotation) = -error_jacobian * turned;
  by_first.block<3, 3>(0, gyroscope_bias) = by_turn * preintegration_.rotation_by_gyroscope_bias();
  by_second.block<3, 3>(0, tangent::rotation) = error_jacobian;
  by_first.block<3, 3>(3, tangent::rotation) = so3::hat(rotation_back * moved);
  by_first.block<3, 3>(3, position) = -rotation_back;
  by_first.block<3, 3>(3, velocity) = -duration * rotation_back;
  by_first.block<3, 3>(3, gyroscope_bias) = -preintegration_.position_by_gyroscope_bias();
  by_first.block<3, 3>(3, accelerometer_bias) = -preintegration_.position_by_accelerometer_bias();
  by_second.block<3, 3>(3, position) = rotation_back;
  by_first.block<3, 3>(6, tangent::rotation) = so3::hat(rotation_back * accelerated);
  by_first.block<3, 3>(6, velocity) = -rotation_back;
  by_first.block<3, 3>(6, gyroscope_bias) = -preintegration_.velocity_by_gyroscope_bias();
  by_first.block<3, 3>(6, accelerometer_bias) = -preintegration_.velocity_by_accelerometer_bias();
  by_second.block<3, 3>(6, velocity) = rotation_back;
  jacobians->by_gravity.block<3, 3>(3, 0) = -0.5 * duration * duration * rotation_back;
  jacobians->by_gravity.block<3, 3>(6, 0) = -duration * rotation_back;

  if (with_axes_) {
    Eigen::Matrix<double, 9, 18> by_axes = -preintegration_.by_axes();
    by_axes.topRows<3>() = by_turn * preintegration_.by_axes().topRows<3>();
    Eigen::Matrix<double, 9, 18> error_by_axes = Eigen::Matrix<double, 9, 18>::Zero();  // of to_readings · error
    for (int row = 0; row < 3; ++row) {
      error_by_axes.block<1, 3>(row, 3 * row) = error.head<3>().transpose();
      error_by_axes.block<1, 3>(3 + row, 9 + 3 * row) = error.segment<3>(3).transpose();
      error_by_axes.block<1, 3>(6 + row, 9 + 3 * row) = error.tail<3>().transpose();
    }
    jacobians->by_axes.topRows<9>() = (whitening * by_axes + whitening_ * error_by_axes) * shown_.asDiagonal();
  }

  by_first.topRows<9>() = (whitening * by_first.topRows<9>()).eval();
  by_second.topRows<9>() = (whitening * by_second.topRows<9>()).eval();
  jacobians->by_gravity.topRows<9>() = (whitening * jacobians->by_gravity.topRows<9>()).eval();
  for (int axis = 0; axis < 3; ++axis) {
    by_first(9 + axis, gyroscope_bias + axis) = -gyroscope_bias_whitening_;
    by_second(9 + axis, gyroscope_bias + axis) = gyroscope_bias_whitening_;
    by_first(12 + axis, accelerometer_bias + axis) = -accelerometer_bias_whitening_;
    by_second(12 + axis, accelerometer_bias + axis) = accelerometer_bias_whitening_;
  }
  return result;
}

bool PreintegrationFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const auto state = [&](const double* pose, const double* motion) {
    NavState result;
    result.T_map_imu = to_pose(pose);
    result.velocity = Vector3(motion);
    result.gyroscope_bias = Vector3(motion + 3);
    result.accelerometer_bias = Vector3(motion + 6);
    result.gravity = Vector3(parameters[4]);
    return result;
  };
  const ImuAxes axes =
      with_axes_ ? ImuAxes(shown_.cwiseProduct(Eigen::Map<const ImuAxes>(parameters[5]))) : preintegration_.axes();
  const NavState first = state(parameters[0], parameters[1]);
  const NavState second = state(parameters[2], parameters[3]);
  if (jacobians == nullptr) {
    Eigen::Map<Vector15>{residuals} = residual(first, second, axes, nullptr);
    return true;
  }
  Jacobians parts;
  Eigen::Map<Vector15>{residuals} = residual(first, second, axes, &parts);
  using MotionJacobian = Eigen::Map<Eigen::Matrix<double, 15, 9, Eigen::RowMajor>>;
  if (jacobians[0] != nullptr) to_ambient(parameters[0], parts.by_first.leftCols<6>(), jacobians[0]);
  if (jacobians[1] != nullptr) MotionJacobian{jacobians[1]} = parts.by_first.rightCols<9>();
  if (jacobians[2] != nullptr) to_ambient(parameters[2], parts.by_second.leftCols<6>(), jacobians[2]);
  if (jacobians[3] != nullptr) MotionJacobian{jacobians[3]} = parts.by_second.rightCols<9>();
  if (jacobians[4] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 15, 3, Eigen::RowMajor>>{jacobians[4]} = parts.by_gravity;
  }
  if (with_axes_ && jacobians[5] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 15, 18, Eigen::RowMajor>>{jacobians[5]} = parts.by_axes;
  }
  return true;
}

ChainLink PreintegrationFactor::link(const NavState& first, const NavState& second) const {
  Jacobians parts;
  residual(first, second, preintegration_.axes(), &parts);
  return {parts.by_first, parts.by_second, parts.by_gravity * s2::boxplus_jacobian(first.gravity)};
}

}  // namespace lodestone
