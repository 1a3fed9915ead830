#include "core/imu/preintegration.h"

#include "core/imu/integration.h"

namespace lodestone {

namespace {

using Matrix3x9 = Eigen::Matrix<double, 3, 9>;

/// (1 + E)⁻¹ of nine entries, row by row.
Matrix3 correction(const double* entries) {
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return (Matrix3::Identity() + Eigen::Map<const Rows>(entries)).inverse();
}

/// ∂(corrected vector)/∂(entries of E).
Matrix3x9 by_entries(const Matrix3& correction, const Vector3& corrected) {
  Matrix3x9 result;
  for (int row = 0; row < 3; ++row) result.middleCols<3>(3 * row) = -correction.col(row) * corrected.transpose();
  return result;
}

}  // namespace

Preintegration::Preintegration(std::span<const ImuSample> samples, const Vector3& gyroscope_bias,
                               const Vector3& accelerometer_bias, const ImuNoise& noise, const ImuAxes& axes)
    : gyroscope_bias_(gyroscope_bias), accelerometer_bias_(accelerometer_bias), axes_(axes) {
  const Matrix3 gyroscope_correction = correction(axes.data());
  const Matrix3 accelerometer_correction = correction(axes.data() + 9);
  const double gyroscope_variance = noise.gyroscope_noise_density * noise.gyroscope_noise_density;
  const double accelerometer_variance = noise.accelerometer_noise_density * noise.accelerometer_noise_density;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    ImuInterval interval = make_interval(samples[i - 1], samples[i], gyroscope_bias, accelerometer_bias);
    const double dt = interval.duration_s;
    if (dt <= 0.0) continue;
    interval.angular_velocity = gyroscope_correction * interval.angular_velocity;
    interval.linear_acceleration = accelerometer_correction * interval.linear_acceleration;
    const Vector3 turn = dt * interval.angular_velocity;
    const Quaternion half_turn = so3::exp(0.5 * turn);
    const Matrix3 rotation = rotation_.toRotationMatrix();
    const Matrix3 half_rotation = rotation * half_turn.toRotationMatrix();
    const Vector3 acceleration = half_rotation * interval.linear_acceleration;
    const Matrix3 turn_back = so3::exp(-turn).toRotationMatrix();
    const Matrix3 right_jacobian = so3::right_jacobian(turn);
    // Derivatives of the mid-interval acceleration by the orientation error at the start and by the bias of the
    // interval's turn.
    const Matrix3 acceleration_by_rotation = -rotation * so3::hat(half_turn * interval.linear_acceleration);
    const Matrix3 acceleration_by_turn_bias = 0.5 * dt * half_rotation * so3::hat(interval.linear_acceleration);

    // Uses the rotation before this interval is added, as the bias does below.
    const Matrix3x9 rate_by_axes = by_entries(gyroscope_correction, interval.angular_velocity);
    const Matrix3x9 force_by_axes = by_entries(accelerometer_correction, interval.linear_acceleration);
    Eigen::Matrix<double, 3, 18> acceleration_by_axes = acceleration_by_rotation * by_axes_.topRows<3>();
    acceleration_by_axes.leftCols<9>() -= acceleration_by_turn_bias * rate_by_axes;
    acceleration_by_axes.rightCols<9>() += half_rotation * force_by_axes;
    by_axes_.middleRows<3>(3) += dt * by_axes_.bottomRows<3>() + 0.5 * dt * dt * acceleration_by_axes;
    by_axes_.bottomRows<3>() += dt * acceleration_by_axes;
    by_axes_.topRows<3>() = (turn_back * by_axes_.topRows<3>()).eval();
    by_axes_.topLeftCorner<3, 9>() += dt * right_jacobian * rate_by_axes;

    const Matrix3 acceleration_by_gyroscope_bias =
        acceleration_by_rotation * rotation_by_gyroscope_bias_ + acceleration_by_turn_bias * gyroscope_correction;
    position_by_gyroscope_bias_ += dt * velocity_by_gyroscope_bias_ + 0.5 * dt * dt * acceleration_by_gyroscope_bias;
    position_by_accelerometer_bias_ +=
        dt * velocity_by_accelerometer_bias_ - 0.5 * dt * dt * half_rotation * accelerometer_correction;
    velocity_by_gyroscope_bias_ += dt * acceleration_by_gyroscope_bias;
    velocity_by_accelerometer_bias_ -= dt * half_rotation * accelerometer_correction;
    rotation_by_gyroscope_bias_ =
        (turn_back * rotation_by_gyroscope_bias_ - dt * right_jacobian * gyroscope_correction).eval();

    // Discrete transition of (φ, p, v); white noise of density σ integrated over dt has variance σ² dt.
    Matrix9 transition = Matrix9::Identity();
    transition.block<3, 3>(0, 0) = turn_back;
    transition.block<3, 3>(3, 0) = 0.5 * dt * dt * acceleration_by_rotation;
    transition.block<3, 3>(3, 6) = dt * Matrix3::Identity();
    transition.block<3, 3>(6, 0) = dt * acceleration_by_rotation;
    covariance_ = (transition * covariance_ * transition.transpose()).eval();
    covariance_.block<3, 3>(0, 0) += gyroscope_variance * dt * right_jacobian * right_jacobian.transpose();
    covariance_.diagonal().segment<3>(3).array() += accelerometer_variance * dt * dt * dt / 3.0;
    covariance_.diagonal().segment<3>(6).array() += accelerometer_variance * dt;
    for (int axis = 0; axis < 3; ++axis) {
      covariance_(3 + axis, 6 + axis) += accelerometer_variance * dt * dt / 2.0;
      covariance_(6 + axis, 3 + axis) += accelerometer_variance * dt * dt / 2.0;
    }

    position_ += dt * velocity_ + 0.5 * dt * dt * acceleration;
    velocity_ += dt * acceleration;
    rotation_ = (rotation_ * half_turn * half_turn).normalized();
    duration_s_ += dt;
  }
}

Preintegration::Increment Preintegration::corrected(const Vector3& gyroscope_bias, const Vector3& accelerometer_bias,
                                                    const ImuAxes& axes) const {
  const Vector3 gyroscope_step = gyroscope_bias - gyroscope_bias_;
  const Vector3 accelerometer_step = accelerometer_bias - accelerometer_bias_;
  const Vector9 by_axes = by_axes_ * (axes - axes_);
  return {(rotation_ * so3::exp(rotation_by_gyroscope_bias_ * gyroscope_step + by_axes.head<3>())).normalized(),
          position_ + position_by_gyroscope_bias_ * gyroscope_step +
              position_by_accelerometer_bias_ * accelerometer_step + by_axes.segment<3>(3),
          velocity_ + velocity_by_gyroscope_bias_ * gyroscope_step +
              velocity_by_accelerometer_bias_ * accelerometer_step + by_axes.tail<3>()};
}

NavState Preintegration::predict(const NavState& start) const {
  const Increment increment = corrected(start.gyroscope_bias, start.accelerometer_bias, axes_);
  NavState end = start;
  const Quaternion& rotation = start.T_map_imu.rotation;
  end.T_map_imu.rotation = (rotation * increment.rotation).normalized();
  end.T_map_imu.position +=
      duration_s_ * start.velocity + 0.5 * duration_s_ * duration_s_ * start.gravity + rotation * increment.position;
  end.velocity += duration_s_ * start.gravity + rotation * increment.velocity;
  return end;
}

bool Preintegration::within_linear_range(const Vector3& gyroscope_bias, const Vector3& accelerometer_bias,
                                         const ImuAxes& axes) const {
  // The first order is exact in the accelerometer bias except for its product with the gyroscope's. The second order in
  // the gyroscope bias is about |δ b_g T|²/2 in angle, and times |Δv| in velocity.
  const Vector9 by_axes = by_axes_ * (axes - axes_);
  const double turn = (gyroscope_bias - gyroscope_bias_).norm() * duration_s_ + by_axes.head<3>().norm();
  const double velocity =
      velocity_.norm() + (accelerometer_bias - accelerometer_bias_).norm() * duration_s_ + by_axes.tail<3>().norm();
  const double second_order_angle = 0.5 * turn * turn;
  const double angle_sigma = std::sqrt(covariance_.diagonal().head<3>().minCoeff());
  const double velocity_sigma = std::sqrt(covariance_.diagonal().tail<3>().minCoeff());
  return second_order_angle < 0.1 * angle_sigma && second_order_angle * velocity < 0.1 * velocity_sigma;
}

}  // namespace lodestone
