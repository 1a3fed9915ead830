#include "core/imu/deskewing.h"

#include <cmath>

namespace lodestone {

Deskewing::Deskewing(const NavState& end, const ScanMotion& motion, const ImuNoise& noise)
    : velocity(end.T_map_imu.rotation.conjugate() * end.velocity),
      before_velocity(motion.relative_begin_velocity()),
      step_s(to_seconds(motion.end_time() - motion.begin_time())),
      gyroscope_density(std::pow(noise.gyroscope_noise_density, 2)),
      accelerometer_density(std::pow(noise.accelerometer_noise_density, 2)) {
  const Pose T_end_before = motion.relative_pose(motion.begin_time());
  turn = T_end_before.rotation.conjugate();
  before_position = T_end_before.position;
}

Vector12 Deskewing::departure(const NavState* before, const NavState& end, Jacobians* jacobians) const {
  const Quaternion& to_map = end.T_map_imu.rotation;
  Vector12 result = Vector12::Zero();
  result.segment<3>(3) = to_map * velocity - end.velocity;
  if (jacobians != nullptr) {
    *jacobians = {};
    jacobians->by_end.block<3, 3>(3, 0) = -to_map.toRotationMatrix() * so3::hat(velocity);
    jacobians->by_end_velocity.middleRows<3>(3) = -Matrix3::Identity();
  }
  if (before == nullptr || step_s <= 0.0) return result;
  // Exp(departure) R_end_before of deskewing = R_end_before of the states.
  const Vector3 turned = so3::log(to_map.conjugate() * before->T_map_imu.rotation * turn);
  result.head<3>() = turned;
  result.segment<3>(6) = before->T_map_imu.position - end.T_map_imu.position - to_map * before_position;
  result.tail<3>() = to_map * before_velocity - before->velocity;
  if (jacobians != nullptr) {
    // Log(Exp(−φ_e) X) = Log X − J_l⁻¹ φ_e, and J_l⁻¹ = J_rᵀ⁻¹; X Exp(turnᵀ φ_b).
    const Matrix3 right = so3::right_jacobian_inverse(turned);
    jacobians->by_end.block<3, 3>(0, 0) = -right.transpose();
    jacobians->by_before.block<3, 3>(0, 0) = right * turn.conjugate().toRotationMatrix();
    jacobians->by_end.block<3, 3>(6, 0) = to_map.toRotationMatrix() * so3::hat(before_position);
    jacobians->by_end.block<3, 3>(6, 3) = -Matrix3::Identity();
    jacobians->by_before.block<3, 3>(6, 3) = Matrix3::Identity();
    jacobians->by_end.block<3, 3>(9, 0) = -to_map.toRotationMatrix() * so3::hat(before_velocity);
    jacobians->by_before_velocity.bottomRows<3>() = -Matrix3::Identity();
  }
  return result;
}

}  // namespace lodestone
