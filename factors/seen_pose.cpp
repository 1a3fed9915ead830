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

MotionRates rates_between(const NavState* before, const NavState& here, const NavState* after, double span_s) {
  MotionRates rates;
  const auto add = [&](const NavState& from, const NavState& to) {
    rates.turn_rate += so3::log(from.T_map_imu.rotation.conjugate() * to.T_map_imu.rotation) / span_s;
    rates.acceleration += here.T_map_imu.rotation.conjugate() * (to.velocity - from.velocity) / span_s;
  };
  if (before != nullptr) add(*before, here);
  if (after != nullptr) add(here, *after);
  return rates;
}

SeenState::SeenState(const CondensedScan& scan, const NavState& own, const MotionRates& rates,
                     const double* calibration)
    : state(own) {
  if (!scan.by_lidar || calibration == nullptr) return;
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  const bool moves = scan.deskewing.step_s > 0.0;
  const double late_s = moves ? calibration[6] - scan.correction.clock_s : 0.0;
  const Vector3 back = -late_s * rates.turn_rate;
  const Vector3 acceleration = own.T_map_imu.rotation * rates.acceleration;
  state.T_map_imu.rotation = (own.T_map_imu.rotation * so3::exp(back)).normalized();
  state.T_map_imu.position -= late_s * own.velocity;
  state.velocity -= late_s * acceleration;
  Matrix9 by_own = Matrix9::Identity();
  by_own.block<3, 3>(0, 0) = so3::exp(back).toRotationMatrix().transpose();
  by_own.block<3, 3>(3, 6) = -late_s * Matrix3::Identity();
  by_own.block<3, 3>(6, 0) = late_s * own.T_map_imu.rotation.toRotationMatrix() * so3::hat(rates.acceleration);
  Eigen::Matrix<double, 9, 1> by_clock;
  by_clock << -so3::right_jacobian(back) * rates.turn_rate, -own.velocity, -acceleration;

  const Matrix3 rotation = state.T_map_imu.rotation.toRotationMatrix();
  const SeenPose seen = see(scan, state.T_map_imu, calibration);
  const Vector3 swing = rates.turn_rate.cross(rotation.transpose() * (seen.pose.position - state.T_map_imu.position));
  state.T_map_imu = seen.pose;
  state.velocity += rotation * swing;
  Matrix9 by_moved = Matrix9::Identity();
  by_moved.topLeftCorner<6, 6>() = seen.by_pose;
  by_moved.block<3, 3>(6, 0) = -rotation * so3::hat(swing);
  by_state = by_moved * by_own;
  by_calibration.topLeftCorner<6, 6>() = seen.by_mounting;
  by_calibration.block<3, 6>(6, 0) =
      rotation * so3::hat(rates.turn_rate) * rotation.transpose() * seen.by_mounting.bottomRows<3>();
  if (moves) by_calibration.col(6) = by_moved * by_clock;
}

}  // namespace lodestone
