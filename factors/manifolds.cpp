#include "factors/manifolds.h"

namespace lodestone {

namespace {

template <int rows, int cols>
using RowMajor = Eigen::Matrix<double, rows, cols, Eigen::RowMajor>;

/// ∂(q ⊗ Exp(φ))/∂φ at φ = 0, coefficients x, y, z, w. Four times its transpose is the inverse on unit quaternions.
Eigen::Matrix<double, 4, 3> quaternion_step(const double* q) {
  Eigen::Matrix<double, 4, 3> step;
  step << q[3], -q[2], q[1], q[2], q[3], -q[0], -q[1], q[0], q[3], -q[0], -q[1], -q[2];
  return 0.5 * step;
}

Eigen::Map<const Vector3> as_vector(const double* x) {
  return Eigen::Map<const Vector3>(x);
}

}  // namespace

Pose to_pose(const double* block) {
  return {Quaternion(block), Vector3(block + 4)};
}

void from_pose(const Pose& pose, double* block) {
  Eigen::Map<Eigen::Vector4d>{block} = pose.rotation.coeffs();
  Eigen::Map<Vector3>(block + 4) = pose.position;
}

void to_ambient(const double* pose_block, const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 6>>& jacobian,
                double* ambient) {
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>> result(ambient, jacobian.rows(), 7);
  result.leftCols<4>() = jacobian.leftCols<3>() * (4.0 * quaternion_step(pose_block).transpose());
  result.rightCols<3>() = jacobian.rightCols<3>();
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Quaternion rotation = Quaternion(x) * so3::exp(as_vector(delta));
  Eigen::Map<Eigen::Vector4d>{x_plus_delta} = rotation.normalized().coeffs();
  for (int i = 0; i < 3; ++i) x_plus_delta[4 + i] = x[4 + i] + delta[3 + i];
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<RowMajor<7, 6>> result(jacobian);
  result.setZero();
  result.topLeftCorner<4, 3>() = quaternion_step(x);
  result.bottomRightCorner<3, 3>().setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector3>{y_minus_x} = so3::log(Quaternion(x).conjugate() * Quaternion(y));
  for (int i = 0; i < 3; ++i) y_minus_x[3 + i] = y[4 + i] - x[4 + i];
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<RowMajor<6, 7>> result(jacobian);
  result.setZero();
  result.topLeftCorner<3, 4>() = 4.0 * quaternion_step(x).transpose();
  result.bottomRightCorner<3, 3>().setIdentity();
  return true;
}

bool GravityManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Eigen::Map<Vector3>{x_plus_delta} = s2::boxplus(as_vector(x), Vector2(delta));
  return true;
}

bool GravityManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<RowMajor<3, 2>>{jacobian} = s2::boxplus_jacobian(as_vector(x));
  return true;
}

bool GravityManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector2>{y_minus_x} = s2::boxminus(as_vector(y), as_vector(x));
  return true;
}

bool GravityManifold::MinusJacobian(const double* x, double* jacobian) const {
  const Vector3 gravity = as_vector(x);
  Eigen::Map<RowMajor<2, 3>>{jacobian} = s2::basis(gravity).transpose() * so3::hat(gravity) / gravity.squaredNorm();
  return true;
}

}  // namespace lodestone
