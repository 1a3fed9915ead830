#include "core/geometry/slide.h"

#include <cmath>

namespace lodestone {

namespace {

constexpr double kLargestTurn_rad_m = 0.3;

/// The rigid motion of a slide by `distance_m`: position and rotation of its place.
Pose motion(const Slide& slide, double distance_m) {
  const Vector3 turn = distance_m * slide.turn;
  // The left Jacobian of SO(3): the mean of the rotations on the way.
  return {so3::exp(turn), so3::right_jacobian(-turn) * (distance_m * slide.direction)};
}

}  // namespace

Slide Slide::along(const Vector6& degenerate, const Pose& pose) {
  Slide result;
  result.at = pose.position;
  const double shift = degenerate.tail<3>().norm();
  if (degenerate.head<3>().norm() > kLargestTurn_rad_m * shift) return result;
  result.direction = degenerate.tail<3>() / shift;
  result.turn = pose.rotation * Vector3(degenerate.head<3>() / shift);
  return result;
}

Slide Slide::about(const Vector3& place) const {
  if (!any()) return *this;
  const Vector3 flow = direction + turn.cross(place - at);
  return {place, flow.normalized(), turn / flow.norm()};
}

Unslid unslide(const Slide& slide, const Pose& pose) {
  Unslid result;
  result.pose = pose;
  if (!slide.any()) return result;
  const Vector3 offset = pose.position - slide.at;
  Vector3 left = offset;
  for (int i = 0; i < 20; ++i) {
    // Level: no component is left along the slide.
    const double step = slide.direction.dot(left) / slide.direction.dot(slide.direction + slide.turn.cross(left));
    result.distance_m += step;
    const Pose back = motion(slide, -result.distance_m);
    result.back = back.rotation;
    left = back.rotation * offset + back.position;
    if (std::abs(step) < 1e-14 * (1.0 + std::abs(result.distance_m))) break;
  }
  result.pose = {(result.back * pose.rotation).normalized(), slide.at + left};
  result.flow = slide.direction + slide.turn.cross(left);
  result.by_position = (result.back.conjugate() * slide.direction) / slide.direction.dot(result.flow);
  return result;
}

Pose moved_by(const Vector6& error, const Pose& pose) {
  return {(so3::exp(error.head<3>()) * pose.rotation).normalized(), pose.position + error.tail<3>()};
}

Matrix6 moved_by_jacobian(const Vector6& error, const Pose& moved) {
  // Exp(φ_d) R Exp(φ): the left Jacobian of φ_d, rotated into the moved body's axes.
  Matrix6 result = Matrix6::Identity();
  result.topLeftCorner<3, 3>() = moved.rotation.toRotationMatrix().transpose() * so3::right_jacobian(-error.head<3>());
  return result;
}

SlideDifference difference_along(const Slide& slide, const Pose& x, const Pose& x0, const Vector6& error) {
  SlideDifference result;
  result.unslid = unslide(slide, x);
  const Unslid& unslid = result.unslid;
  Vector6 along;
  along << x0.rotation.conjugate() * slide.turn, slide.direction;
  const Pose moved = moved_by(error, unslid.pose);
  result.value = moved.boxminus(x0);
  const Matrix3 turning = so3::right_jacobian_inverse(result.value.head<3>());
  result.by_error = moved_by_jacobian(error, moved);
  result.by_error.topRows<3>() = (turning * result.by_error.topRows<3>()).eval();
  result.value += unslid.distance_m * along;
  result.by_tangent.setZero();
  result.by_tangent.topLeftCorner<3, 3>() = turning;
  if (!slide.any()) {
    result.by_tangent.bottomRightCorner<3, 3>().setIdentity();
    return result;
  }
  const Vector3 own_turn = unslid.pose.rotation.conjugate() * slide.turn;
  result.by_tangent.topRightCorner<3, 3>() = (along.head<3>() - turning * own_turn) * unslid.by_position.transpose();
  result.by_tangent.bottomRightCorner<3, 3>() =
      unslid.back.toRotationMatrix() + (slide.direction - unslid.flow) * unslid.by_position.transpose();
  return result;
}

}  // namespace lodestone
