#include "factors/seen_pose.h"

#include "core/geometry/slide.h"

namespace lodestone {

SeenPose see(const CondensedScan& scan, const Pose& T_map_imu, const double* mounting) {
  SeenPose seen{T_map_imu};
  if (!scan.by_lidar || mounting == nullptr) return seen;
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  const Vector3 turn = Vector3(mounting) - scan.correction.turn_rad;
  const Matrix3 turned = so3::exp(turn).toRotationMatrix();
  const Vector3 shift =
      Vector3(mounting + 3) - scan.correction.shift_m + scan.beam_origin_m - turned * scan.beam_origin_m;
  seen.pose.rotation = (T_map_imu.rotation * so3::exp(turn)).normalized();
  seen.pose.position += rotation * shift;
  const Matrix3 right = so3::right_jacobian(turn);
  seen.by_pose.topLeftCorner<3, 3>() = turned.transpose();
  seen.by_pose.bottomLeftCorner<3, 3>() = -rotation * so3::hat(shift);
  seen.by_mounting.topLeftCorner<3, 3>() = right;
  seen.by_mounting.bottomLeftCorner<3, 3>() = rotation * turned * so3::hat(scan.beam_origin_m) * right;
  seen.by_mounting.bottomRightCorner<3, 3>() = rotation;
  return seen;
}

void move_by(const Vector6& map_error, SeenPose& seen) {
  seen.pose = moved_by(map_error, seen.pose);
  seen.by_map_error = moved_by_jacobian(map_error, seen.pose);
}

ClockShift::ClockShift(const CondensedScan& scan, const NavState& end, double clock_s) {
  const Deskewing& deskewing = scan.deskewing;
  if (!scan.by_lidar || deskewing.step_s <= 0.0) return;
  late_s = clock_s - scan.correction.clock_s;
  turn_rate = deskewing.turn_rate;
  const Matrix3 to_map = end.T_map_imu.rotation.toRotationMatrix();
  acceleration = to_map * deskewing.acceleration;
  acceleration_by_end = -to_map * so3::hat(deskewing.acceleration);
  const Vector3 back = -late_s * turn_rate;
  turned = so3::exp(back).toRotationMatrix().transpose();
  turn_by_clock = -so3::right_jacobian(back) * turn_rate;
}

NavState ClockShift::moved(const NavState& state) const {
  NavState result = state;
  result.T_map_imu.rotation = (state.T_map_imu.rotation * so3::exp(-late_s * turn_rate)).normalized();
  result.T_map_imu.position -= late_s * state.velocity;
  result.velocity -= late_s * acceleration;
  return result;
}

}  // namespace lodestone
