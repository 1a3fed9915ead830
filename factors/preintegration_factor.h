#pragma once

#include <ceres/cost_function.h>

#include "core/imu/preintegration.h"
#include "core/observability/window_information.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// How much each column of E counts in the factor after this motion, 0 to 1: near 0 if the motion is below ten sigmas
/// of the readings' noise. Source: docs/design/045-axes-of-the-imu.md.
Vector6 axes_shown_after(const Preintegration& motion);

/// IMU between two keyframes: rotation, position and velocity against the preintegrated increment, and the random walk
/// of both biases; 15 whitened residuals. Source: Forster et al. 2017, eq. (45), with gravity as a variable.
/// Parameters: pose i (7), motion i (9), pose j (7), motion j (9), gravity (3), and the axes of the IMU (18) if they
/// are estimated. The content may be replaced between solves (re-integration at other biases). Errors are those of
/// readings: an error of corrected increments, times 1 + E. `shown`: how much each column of E counts, of the
/// gyroscope, then of the accelerometer (docs/design/045-axes-of-the-imu.md).
class PreintegrationFactor final : public ceres::CostFunction {
 public:
  PreintegrationFactor(const Preintegration& preintegration, const ImuNoise& noise, bool with_axes = false,
                       const Vector6& shown = Vector6::Ones())
      : with_axes_(with_axes) {
    for (int i = 0; i < 18; ++i) shown_[i] = shown[3 * (i / 9) + i % 3];
    set_num_residuals(15);
    *mutable_parameter_block_sizes() = {7, 9, 7, 9, 3};
    if (with_axes) mutable_parameter_block_sizes()->push_back(18);
    set(preintegration, noise);
  }

  void set(const Preintegration& preintegration, const ImuNoise& noise);

  const Preintegration& preintegration() const { return preintegration_; }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  /// The factor at two states as a link of the window's chain: whitened Jacobians by the tangents, with constant axes.
  ChainLink link(const NavState& first, const NavState& second) const;

 private:
  struct Jacobians {
    Matrix15 by_first = Matrix15::Zero();
    Matrix15 by_second = Matrix15::Zero();
    Eigen::Matrix<double, 15, 3> by_gravity = Eigen::Matrix<double, 15, 3>::Zero();  // ambient
    Eigen::Matrix<double, 15, 18> by_axes = Eigen::Matrix<double, 15, 18>::Zero();
  };
  Vector15 residual(const NavState& first, const NavState& second, const ImuAxes& axes, Jacobians* jacobians) const;

  bool with_axes_;
  ImuAxes shown_;  // factor of each entry of E
  Preintegration preintegration_{{}, Vector3::Zero(), Vector3::Zero(), ImuNoise{}};
  Matrix9 whitening_ = Matrix9::Identity();  // L⁻¹ of the increment's covariance L Lᵀ
  double gyroscope_bias_whitening_ = 1.0;
  double accelerometer_bias_whitening_ = 1.0;
};

}  // namespace lodestone
