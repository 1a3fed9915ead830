#pragma once

#include "core/geometry/nav_state.h"
#include "core/sensor_suite.h"
#include "core/wheels/wheel_correction.h"
#include "core/wheels/wheel_reading.h"

namespace lodestone {

/// Parameters of the wheels' calibration: scale, then the rotation vector.
inline constexpr int kWheelParameters = 4;

/// Residual of a reading in units of its sigmas,
///   r = Σ^(−1/2) (m − (1 + s) Exp(−θ) u),
/// with the scale s (calibration and slip), the correction θ of the mounting, and the expected velocity u
/// (WheelReading), and its derivatives.
struct WheelResidual {
  Vector3 value = Vector3::Zero();
  Matrix3 by_rotation = Matrix3::Zero();  ///< φ of R Exp(φ)
  Matrix3 by_velocity = Matrix3::Zero();
  Matrix3 by_gyroscope_bias = Matrix3::Zero();
  Eigen::Matrix<double, 3, kWheelParameters> by_calibration = Eigen::Matrix<double, 3, kWheelParameters>::Zero();

  /// By the state's tangent (namespace tangent).
  Eigen::Matrix<double, 3, tangent::size> by_state() const;
};

WheelResidual wheel_residual(const WheelReading& reading, const Quaternion& R_map_imu, const Vector3& velocity,
                             const Vector3& gyroscope_bias, const WheelCorrection& correction);

/// Gate of weigh_wheels: that of the field's Huber weight (docs/design/049-wheels.md).
inline constexpr double kWheelProbability = 0.95;

/// Covariance of the residual for estimators without states of the calibration: its errors are white noise with the
/// integral of a process of the slip's correlation time (docs/design/049-wheels.md). `step_s`: between two readings.
Matrix3 wheel_noise(const WheelResidual& residual, const WheelCalibrationSigmas& sigmas, double step_s);

/// The size of a jump of the slip, relative to the velocity, that explains the forward velocity. 0: the innovation is
/// within 3.5 sigmas, the wheels stand still, or the jump exceeds the velocity itself: spinning wheels.
double slip_jump(const NavState& predicted, const Matrix17& covariance, const WheelCorrection& correction,
                 const WheelCalibrationSigmas& sigmas, const WheelReading& reading);

/// Reduces the weight of each component whose innovation is beyond the χ² quantile of `probability`: spinning or
/// blocked wheels. `covariance`: of the predicted state. The weight is (quantile / distance)². Returns the least
/// weight.
double weigh_wheels(const NavState& predicted, const Matrix17& covariance, const WheelCorrection& correction,
                    const WheelCalibrationSigmas& sigmas, double probability, WheelReading& reading);

}  // namespace lodestone
