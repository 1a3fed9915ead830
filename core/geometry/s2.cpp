#include "core/geometry/s2.h"

#include <cmath>

namespace lodestone::s2 {

Eigen::Matrix<double, 3, 2> basis(const Vector3& vector) {
  const Vector3 unit = vector.normalized();
  // The coordinate axis least aligned with the vector; ties go to the lowest index.
  int axis = 0;
  unit.cwiseAbs().minCoeff(&axis);
  Eigen::Matrix<double, 3, 2> result;
  result.col(0) = Vector3(unit.cross(Vector3::Unit(axis))).normalized();
  result.col(1) = unit.cross(result.col(0));
  return result;
}

Vector3 boxplus(const Vector3& vector, const Vector2& delta) {
  return so3::exp(basis(vector) * delta) * vector;
}

Vector2 boxminus(const Vector3& vector, const Vector3& reference) {
  const Vector3 axis = reference.cross(vector);
  const double sine = axis.norm();
  const double cosine = reference.dot(vector);
  const double angle = std::atan2(sine, cosine);
  const Eigen::Matrix<double, 3, 2> tangent = basis(reference);
  if (sine < 1e-300) return cosine > 0.0 ? Vector2::Zero().eval() : Vector2(M_PI, 0.0);
  return angle / sine * (tangent.transpose() * axis);
}

Eigen::Matrix<double, 3, 2> boxplus_jacobian(const Vector3& vector) {
  return -so3::hat(vector) * basis(vector);
}

Eigen::Matrix2d boxminus_jacobian(const Vector3& vector, const Vector3& reference) {
  const double squared_length = reference.norm() * vector.norm();
  const Vector3 axis = reference.cross(vector) / squared_length;  // length sin θ
  const double sine = axis.norm();
  const double cosine = reference.dot(vector) / squared_length;
  const double angle = std::atan2(sine, cosine);
  // f = θ / sin θ and its derivative by −cos θ; series about θ = 0.
  const bool small = sine < 1e-4;
  const double factor = small ? 1.0 + angle * angle / 6.0 : angle / sine;
  const double slope = small ? 1.0 / 3.0 : (sine - angle * cosine) / (sine * sine * sine);
  const Eigen::Matrix<double, 3, 2> step = boxplus_jacobian(vector);
  const Eigen::Matrix<double, 3, 2> axis_step = so3::hat(reference) * step / squared_length;
  const Eigen::Matrix<double, 1, 2> cosine_step = reference.transpose() * step / squared_length;
  return basis(reference).transpose() * (factor * axis_step - slope * axis * cosine_step);
}

}  // namespace lodestone::s2
