#include "factors/field_step_factor.h"

#include <Eigen/LU>

#include "factors/row_major.h"

namespace lodestone {

bool FieldStepFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const Vector3> before(parameters[0]);
  const Eigen::Map<const Vector3> after(parameters[1]);
  const Matrix3 A = distortion_matrix(Eigen::Map<const Distortion>(parameters[2]));
  const Matrix3 inverse = A.inverse();
  const Vector3 turn_of_bias = step_.turn_by_bias * Eigen::Map<const Vector3>(parameters[3]);
  const Matrix3 turn_back = (step_.turn * so3::exp(turn_of_bias)).conjugate().toRotationMatrix();
  const Vector3 field = inverse * before;
  const Vector3 turned = turn_back * field;
  Eigen::Map<Vector3> residual(residuals);
  residual = step_.after_weight * after - step_.before_weight * (A * turned);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) row_major<3, 3>(jacobians[0]) = -step_.before_weight * A * turn_back * inverse;
  if (jacobians[1] != nullptr) row_major<3, 3>(jacobians[1]) = step_.after_weight * Matrix3::Identity();
  if (jacobians[2] != nullptr) {
    // d(A T A⁻¹ y) = dA (T A⁻¹ y) − A T A⁻¹ dA (A⁻¹ y)
    row_major<3, 9>(jacobians[2]) =
        -step_.before_weight * (distortion_jacobian(turned) - A * turn_back * inverse * distortion_jacobian(field));
  }
  if (jacobians[3] != nullptr) {
    // (ΔR Exp(φ))ᵀ v = Exp(−φ) ΔRᵀ v ≈ ΔRᵀ v + [ΔRᵀ v]× φ
    row_major<3, 3>(jacobians[3]) =
        -step_.before_weight * A * so3::hat(turned) * so3::right_jacobian(turn_of_bias) * step_.turn_by_bias;
  }
  return true;
}

}  // namespace lodestone
