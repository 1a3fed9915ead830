#include "core/imu/deskewing.h"

#include <cmath>

namespace lodestone {

Deskewing::Deskewing(const NavState& end, const ScanMotion& motion, const ImuNoise& noise)
    : turn(motion.relative_pose(motion.begin_time()).rotation.conjugate()),
      velocity(end.T_map_imu.rotation.conjugate() * end.velocity),
      step_s(to_seconds(motion.end_time() - motion.begin_time())),
      gyroscope_density(std::pow(noise.gyroscope_noise_density, 2)),
      accelerometer_density(std::pow(noise.accelerometer_noise_density, 2)) {}

Vector6 Deskewing::rates(const Quaternion* before, const Quaternion& end, const Vector3& end_velocity,
                         Jacobians* jacobians) const {
  Vector6 result;
  result << Vector3::Zero(), end * velocity - end_velocity;
  if (jacobians != nullptr) {
    *jacobians = {};
    jacobians->shift_by_end = -end.toRotationMatrix() * so3::hat(velocity);
  }
  if (before == nullptr || step_s <= 0.0) return result;
  // The gyroscope told `turn`; the states tell turn Exp(departure). Spread evenly over the step, t before the end the
  // points were turned too far by t / step of it.
  const Vector3 departure = so3::log(turn.conjugate() * before->conjugate() * end);
  result.head<3>() = -departure / step_s;
  if (jacobians != nullptr) {
    jacobians->turn_by_end = -so3::right_jacobian_inverse(departure) / step_s;
    jacobians->turn_by_before = -jacobians->turn_by_end * (end.conjugate() * *before).toRotationMatrix();
  }
  return result;
}

}  // namespace lodestone
