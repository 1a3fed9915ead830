#pragma once

#include <span>
#include <vector>

#include "core/geometry/nav_state.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Error of the scale and axes of an IMU: reading = (1 + E) true value + bias; E of the gyroscope, then of the
/// accelerometer, row by row.
using ImuAxes = Eigen::Matrix<double, 18, 1>;

/// Relative motion between two states, measured by the IMU and independent of the states: on the manifold, with
/// covariance and Jacobians by biases and axes. Source: Forster et al., TRO 2017; midpoint rule instead of Euler's.
class Preintegration {
 public:
  /// Integrates `samples` (the first at state i's time, the last at state j's) with the given biases and axes.
  Preintegration(std::span<const ImuSample> samples, const Vector3& gyroscope_bias, const Vector3& accelerometer_bias,
                 const ImuNoise& noise, const ImuAxes& axes = ImuAxes::Zero());

  /// ΔR, Δp (m), Δv (m/s) corrected to first order for biases and axes that differ from those of the integration.
  struct Increment {
    Quaternion rotation;
    Vector3 position;
    Vector3 velocity;
  };
  Increment corrected(const Vector3& gyroscope_bias, const Vector3& accelerometer_bias, const ImuAxes& axes) const;

  /// State j predicted from state i, with the axes of the integration.
  NavState predict(const NavState& start) const;

  /// Whether the neglected second order is small, in sigmas of the increment's covariance, after biases and axes have
  /// moved. Above about 0.1 sigmas, integrate again.
  bool within_linear_range(const Vector3& gyroscope_bias, const Vector3& accelerometer_bias, const ImuAxes& axes) const;

  double duration_s() const { return duration_s_; }
  const Vector3& gyroscope_bias() const { return gyroscope_bias_; }
  const Vector3& accelerometer_bias() const { return accelerometer_bias_; }
  const ImuAxes& axes() const { return axes_; }

  /// 9×9, order φ, p, v.
  const Matrix9& covariance() const { return covariance_; }

  const Matrix3& rotation_by_gyroscope_bias() const { return rotation_by_gyroscope_bias_; }
  const Matrix3& position_by_gyroscope_bias() const { return position_by_gyroscope_bias_; }
  const Matrix3& position_by_accelerometer_bias() const { return position_by_accelerometer_bias_; }
  const Matrix3& velocity_by_gyroscope_bias() const { return velocity_by_gyroscope_bias_; }
  const Matrix3& velocity_by_accelerometer_bias() const { return velocity_by_accelerometer_bias_; }

  /// 9×18, order φ, p, v.
  const Eigen::Matrix<double, 9, 18>& by_axes() const { return by_axes_; }

 private:
  Vector3 gyroscope_bias_;
  Vector3 accelerometer_bias_;
  ImuAxes axes_;
  double duration_s_ = 0.0;
  Quaternion rotation_ = Quaternion::Identity();
  Vector3 position_ = Vector3::Zero();
  Vector3 velocity_ = Vector3::Zero();
  Matrix9 covariance_ = Matrix9::Zero();
  Matrix3 rotation_by_gyroscope_bias_ = Matrix3::Zero();
  Matrix3 position_by_gyroscope_bias_ = Matrix3::Zero();
  Matrix3 position_by_accelerometer_bias_ = Matrix3::Zero();
  Matrix3 velocity_by_gyroscope_bias_ = Matrix3::Zero();
  Matrix3 velocity_by_accelerometer_bias_ = Matrix3::Zero();
  Eigen::Matrix<double, 9, 18> by_axes_ = Eigen::Matrix<double, 9, 18>::Zero();
};

}  // namespace lodestone
