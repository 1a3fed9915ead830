#pragma once

#include "core/geometry/so3.h"

namespace lodestone {

using Vector2 = Eigen::Vector2d;

/// Vectors of one fixed length (gravity): two degrees of freedom. g ⊞ δ = Exp(B(g) δ) g, with B(g) an orthonormal
/// basis of the plane perpendicular to g. Source: Hertzberg et al. 2013, as in FAST-LIO2.
namespace s2 {

/// Orthonormal 3×2 basis of the tangent plane at `vector`; a deterministic, piecewise smooth choice.
Eigen::Matrix<double, 3, 2> basis(const Vector3& vector);

/// `vector` rotated by the tangent step δ (radians).
Vector3 boxplus(const Vector3& vector, const Vector2& delta);

/// The δ with boxplus(reference, δ) parallel to `vector`, |δ| ≤ π.
Vector2 boxminus(const Vector3& vector, const Vector3& reference);

/// ∂(g ⊞ δ)/∂δ at δ = 0: −hat(g) B(g), 3×2.
Eigen::Matrix<double, 3, 2> boxplus_jacobian(const Vector3& vector);

/// ∂boxminus(g ⊞ δ, reference)/∂δ at δ = 0, 2×2.
Eigen::Matrix2d boxminus_jacobian(const Vector3& vector, const Vector3& reference);

}  // namespace s2
}  // namespace lodestone
