#include "core/geometry/so3.h"

#include <cmath>

namespace lodestone::so3 {

namespace {
// Below this squared angle the Taylor series is exact to double precision.
constexpr double kSmallAngleSquared = 1e-8;
}  // namespace

Matrix3 hat(const Vector3& v) {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Quaternion exp(const Vector3& rotation_vector) {
  const double angle_squared = rotation_vector.squaredNorm();
  double real = 0.0;
  double imaginary = 0.0;
  if (angle_squared < kSmallAngleSquared) {
    real = 1.0 - angle_squared / 8.0;
    imaginary = 0.5 - angle_squared / 48.0;
  } else {
    const double angle = std::sqrt(angle_squared);
    real = std::cos(0.5 * angle);
    imaginary = std::sin(0.5 * angle) / angle;
  }
  return Quaternion(real, imaginary * rotation_vector.x(), imaginary * rotation_vector.y(),
                    imaginary * rotation_vector.z());
}

Vector3 log(const Quaternion& rotation) {
  const Vector3 v = rotation.vec();
  const double sine_squared = v.squaredNorm();
  const double w = rotation.w();
  double factor = 0.0;
  if (sine_squared < kSmallAngleSquared) {
    // 2 atan2(s, w) / s, expanded about s = 0; the sign of w selects the shorter rotation.
    factor = 2.0 / w - 2.0 / 3.0 * sine_squared / (w * w * w);
  } else {
    const double sine = std::sqrt(sine_squared);
    factor = 2.0 * (w < 0.0 ? std::atan2(-sine, -w) : std::atan2(sine, w)) / sine;
  }
  return factor * v;
}

Matrix3 right_jacobian(const Vector3& rotation_vector) {
  const double angle_squared = rotation_vector.squaredNorm();
  const Matrix3 skew = hat(rotation_vector);
  double first = 0.0;
  double second = 0.0;
  if (angle_squared < 1e-6) {
    first = 0.5 - angle_squared / 24.0;
    second = 1.0 / 6.0 - angle_squared / 120.0;
  } else {
    const double angle = std::sqrt(angle_squared);
    first = (1.0 - std::cos(angle)) / angle_squared;
    second = (angle - std::sin(angle)) / (angle_squared * angle);
  }
  return Matrix3::Identity() - first * skew + second * skew * skew;
}

Matrix3 right_jacobian_inverse(const Vector3& rotation_vector) {
  const double angle_squared = rotation_vector.squaredNorm();
  const Matrix3 skew = hat(rotation_vector);
  double second = 0.0;
  if (angle_squared < 1e-4) {
    second = 1.0 / 12.0 + angle_squared / 720.0;
  } else {
    const double angle = std::sqrt(angle_squared);
    second = 1.0 / angle_squared - (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle));
  }
  return Matrix3::Identity() + 0.5 * skew + second * skew * skew;
}

}  // namespace lodestone::so3
