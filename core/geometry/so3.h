#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace lodestone {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;  ///< Hamilton; coefficients stored x, y, z, w
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The rotation group SO(3). Perturbations are on the right: R ⊞ φ = R Exp(φ), φ the full angle in radians.
namespace so3 {

/// Skew-symmetric matrix: hat(a) b = a × b.
Matrix3 hat(const Vector3& v);

/// Exp: rotation vector (rad) to unit quaternion.
Quaternion exp(const Vector3& rotation_vector);

/// Log: unit quaternion to rotation vector (rad), of length at most π.
Vector3 log(const Quaternion& rotation);

/// Right Jacobian J_r: Exp(φ + δ) ≈ Exp(φ) Exp(J_r(φ) δ). Source: Forster et al. 2017, eq. (8).
Matrix3 right_jacobian(const Vector3& rotation_vector);

/// Inverse of the right Jacobian: Log(Exp(φ) Exp(δ)) ≈ φ + J_r⁻¹(φ) δ. Source: Forster et al. 2017, eq. (9).
Matrix3 right_jacobian_inverse(const Vector3& rotation_vector);

}  // namespace so3
}  // namespace lodestone
