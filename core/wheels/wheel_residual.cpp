#include "core/wheels/wheel_residual.h"

#include <algorithm>
#include <cmath>

#include "core/robust_weight.h"

namespace lodestone {

namespace {

// A larger innovation is a jump of the slip (docs/design/049-wheels.md).
constexpr double kSlipJumpSigmas = 3.5;

/// Variances of scale with slip, and of the rotation vector, rad².
Eigen::Vector4d wheel_calibration_variance(const WheelCalibrationSigmas& sigmas) {
  const double turn_sigma_rad = sigmas.rotation_sigma_deg * M_PI / 180.0;
  Eigen::Vector4d variance;
  variance << sigmas.scale_sigma * sigmas.scale_sigma + sigmas.slip_sigma * sigmas.slip_sigma,
      Vector3::Constant(turn_sigma_rad * turn_sigma_rad);
  return variance;
}

/// Covariance of the residual at the prediction, in units of the reading's sigmas.
Matrix3 innovation_covariance(const WheelResidual& residual, const Matrix17& covariance,
                              const WheelCalibrationSigmas& sigmas) {
  const auto by_state = residual.by_state();
  return Matrix3::Identity() + by_state * covariance * by_state.transpose() +
         residual.by_calibration * wheel_calibration_variance(sigmas).asDiagonal() *
             residual.by_calibration.transpose();
}

}  // namespace

Eigen::Matrix<double, 3, tangent::size> WheelResidual::by_state() const {
  Eigen::Matrix<double, 3, tangent::size> result = Eigen::Matrix<double, 3, tangent::size>::Zero();
  result.middleCols<3>(tangent::rotation) = by_rotation;
  result.middleCols<3>(tangent::velocity) = by_velocity;
  result.middleCols<3>(tangent::gyroscope_bias) = by_gyroscope_bias;
  return result;
}

WheelResidual wheel_residual(const WheelReading& reading, const Quaternion& R_map_imu, const Vector3& velocity,
                             const Vector3& gyroscope_bias, const WheelCorrection& correction) {
  const Matrix3 whitening = reading.inverse_sigma_s_m.asDiagonal();
  const Matrix3 turn = so3::exp(-correction.turn_rad).toRotationMatrix();
  const Vector3 expected = turn * reading.expected_m_s(R_map_imu, velocity, gyroscope_bias);
  const Matrix3 by_expected = -(1.0 + correction.scale) * whitening;
  const Matrix3 by_body_velocity = by_expected * turn * reading.by_velocity;
  WheelResidual result;
  result.value = whitening * (reading.measured_m_s - (1.0 + correction.scale) * expected);
  // (R Exp(φ))ᵀ v ≈ Rᵀ v + (Rᵀ v) × φ.
  result.by_rotation = by_body_velocity * so3::hat(R_map_imu.conjugate() * velocity);
  result.by_velocity = by_body_velocity * R_map_imu.conjugate().toRotationMatrix();
  result.by_gyroscope_bias = by_expected * turn * reading.by_gyroscope_bias;
  result.by_calibration.col(0) = -whitening * expected;
  // Exp(−θ − δ) u ≈ Exp(−θ) u + (Exp(−θ) u) × J_r(θ) δ.
  result.by_calibration.rightCols<3>() = by_expected * so3::hat(expected) * so3::right_jacobian(correction.turn_rad);
  return result;
}

Matrix3 wheel_noise(const WheelResidual& residual, const WheelCalibrationSigmas& sigmas, double step_s) {
  const double repeats = std::max(1.0, 2.0 * kSlipCorrelation_s / step_s);
  const Eigen::Vector4d variance = repeats * wheel_calibration_variance(sigmas);
  return Matrix3::Identity() + residual.by_calibration * variance.asDiagonal() * residual.by_calibration.transpose();
}

double slip_jump(const NavState& predicted, const Matrix17& covariance, const WheelCorrection& correction,
                 const WheelCalibrationSigmas& sigmas, const WheelReading& reading) {
  if (reading.standstill || sigmas.slip_sigma == 0.0) return 0.0;
  const WheelResidual residual =
      wheel_residual(reading, predicted.T_map_imu.rotation, predicted.velocity, predicted.gyroscope_bias, correction);
  const double innovation = std::abs(residual.value.x());
  const double expected = std::abs(residual.by_calibration(0, 0));  // in sigmas, as the innovation
  const double sigma = std::sqrt(innovation_covariance(residual, covariance, sigmas)(0, 0));
  return innovation > kSlipJumpSigmas * sigma && innovation <= expected ? innovation / expected : 0.0;
}

double weigh_wheels(const NavState& predicted, const Matrix17& covariance, const WheelCorrection& correction,
                    const WheelCalibrationSigmas& sigmas, double probability, WheelReading& reading) {
  const WheelResidual residual =
      wheel_residual(reading, predicted.T_map_imu.rotation, predicted.velocity, predicted.gyroscope_bias, correction);
  const Matrix3 innovation = innovation_covariance(residual, covariance, sigmas);
  const double threshold = mahalanobis_quantile(1, probability);
  double least = 1.0;
  for (int i = 0; i < 3; ++i) {
    if (reading.inverse_sigma_s_m[i] == 0.0) continue;
    const double root = huber_weight(std::abs(residual.value[i]) / std::sqrt(innovation(i, i)), threshold);
    reading.inverse_sigma_s_m[i] *= root;
    least = std::min(least, root * root);
  }
  return least;
}

}  // namespace lodestone
