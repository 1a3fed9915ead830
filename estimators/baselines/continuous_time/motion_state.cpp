#include "estimators/baselines/continuous_time/motion_state.h"

namespace lodestone {

MotionState MotionState::boxplus(const Vector15& delta) const {
  MotionState result;
  result.T_map_imu = T_map_imu.boxplus(delta.head<6>());
  result.velocity = velocity + delta.segment<3>(motion_tangent::velocity);
  result.angular_velocity = angular_velocity + delta.segment<3>(motion_tangent::angular_velocity);
  result.acceleration = acceleration + delta.segment<3>(motion_tangent::acceleration);
  return result;
}

Vector15 MotionState::boxminus(const MotionState& other) const {
  Vector15 delta;
  delta.head<6>() = T_map_imu.boxminus(other.T_map_imu);
  delta.segment<3>(motion_tangent::velocity) = velocity - other.velocity;
  delta.segment<3>(motion_tangent::angular_velocity) = angular_velocity - other.angular_velocity;
  delta.segment<3>(motion_tangent::acceleration) = acceleration - other.acceleration;
  return delta;
}

Pose MotionState::relative_pose(double age_s) const {
  return {so3::exp(-age_s * angular_velocity),
          -age_s * (T_map_imu.rotation.conjugate() * velocity) + 0.5 * age_s * age_s * acceleration};
}

Vector15 MotionState::point_jacobian(const Vector3& point, const Vector3& normal, double age_s) const {
  const Vector3 normal_in_imu = T_map_imu.rotation.conjugate() * normal;
  const Vector3 velocity_in_imu = T_map_imu.rotation.conjugate() * velocity;
  const double half_square = 0.5 * age_s * age_s;
  const Vector3 from_position_then = point + age_s * velocity_in_imu - half_square * acceleration;
  // The velocity is in map axes, so a rotation of the state does not turn −v τ.
  const Vector3 turned = point + age_s * velocity_in_imu;
  Vector15 jacobian;
  jacobian.segment<3>(motion_tangent::rotation) = turned.cross(normal_in_imu);
  jacobian.segment<3>(motion_tangent::position) = normal;
  jacobian.segment<3>(motion_tangent::velocity) = -age_s * normal;
  // Exp(−(ω + δ) τ) = Exp(−J_l τ δ) Exp(−ω τ), J_l(−ω τ) = J_r(ω τ).
  jacobian.segment<3>(motion_tangent::angular_velocity) =
      -age_s * so3::right_jacobian(age_s * angular_velocity).transpose() * from_position_then.cross(normal_in_imu);
  jacobian.segment<3>(motion_tangent::acceleration) = half_square * normal_in_imu;
  return jacobian;
}

MotionState propagate_motion(const MotionState& state, double step_s, const MotionNoise& noise, Matrix15& covariance) {
  using namespace motion_tangent;
  const double t = step_s;
  const Matrix3 R = state.T_map_imu.rotation.toRotationMatrix();
  const Vector3 turn = t * state.angular_velocity;
  MotionState result = state;
  result.T_map_imu.rotation = (state.T_map_imu.rotation * so3::exp(turn)).normalized();
  result.T_map_imu.position += t * state.velocity + 0.5 * t * t * (R * state.acceleration);
  result.velocity += t * (R * state.acceleration);

  const Matrix3 identity = Matrix3::Identity();
  Matrix15 transition = Matrix15::Identity();
  transition.block<3, 3>(rotation, rotation) = so3::exp(-turn).toRotationMatrix();
  transition.block<3, 3>(rotation, angular_velocity) = t * so3::right_jacobian(turn);
  transition.block<3, 3>(position, rotation) = -0.5 * t * t * R * so3::hat(state.acceleration);
  transition.block<3, 3>(position, velocity) = t * identity;
  transition.block<3, 3>(position, acceleration) = 0.5 * t * t * R;
  transition.block<3, 3>(velocity, rotation) = -t * R * so3::hat(state.acceleration);
  transition.block<3, 3>(velocity, acceleration) = t * R;

  Matrix15 added = Matrix15::Zero();
  const auto add = [&](int row, int column, const Matrix3& block) {
    added.block<3, 3>(row, column) = block;
    added.block<3, 3>(column, row) = block.transpose();
  };
  const double angular = noise.angular_acceleration_density * noise.angular_acceleration_density;
  add(rotation, rotation, angular * t * t * t / 3.0 * identity);
  add(rotation, angular_velocity, angular * t * t / 2.0 * identity);
  add(angular_velocity, angular_velocity, angular * t * identity);
  const double jerk = noise.jerk_density * noise.jerk_density;
  add(position, position, jerk * t * t * t * t * t / 20.0 * identity);
  add(position, velocity, jerk * t * t * t * t / 8.0 * identity);
  add(position, acceleration, jerk * t * t * t / 6.0 * R);
  add(velocity, velocity, jerk * t * t * t / 3.0 * identity);
  add(velocity, acceleration, jerk * t * t / 2.0 * R);
  add(acceleration, acceleration, jerk * t * identity);
  covariance = (transition * covariance * transition.transpose() + added).eval();
  return result;
}

}  // namespace lodestone
