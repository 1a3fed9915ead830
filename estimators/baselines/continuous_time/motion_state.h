#pragma once

#include "core/geometry/pose.h"

namespace lodestone {

/// Offsets of the tangent vector's parts: φ, p, v, ω, a.
namespace motion_tangent {
constexpr int rotation = 0;
constexpr int position = 3;
constexpr int velocity = 6;
constexpr int angular_velocity = 9;
constexpr int acceleration = 12;
constexpr int size = 15;
}  // namespace motion_tangent

using Vector15 = Eigen::Matrix<double, 15, 1>;
using Matrix15 = Eigen::Matrix<double, 15, 15>;

/// State of a trajectory that is a Gaussian process: angular acceleration and jerk are white noise. Source: Shen et
/// al., CTE-MLO (IEEE Transactions on Field Robotics 2025), and docs/design/057-continuous-time.md.
struct MotionState {
  Pose T_map_imu;
  Vector3 velocity = Vector3::Zero();          ///< of imu in map axes, m/s
  Vector3 angular_velocity = Vector3::Zero();  ///< imu axes, rad/s
  Vector3 acceleration = Vector3::Zero();      ///< of imu, without gravity, imu axes, m/s²

  MotionState boxplus(const Vector15& delta) const;

  /// The δ with other.boxplus(δ) equal to this.
  Vector15 boxminus(const MotionState& other) const;

  /// T_now_then: transforms points in the imu frame `age_s` seconds before this state to the imu frame of this state.
  /// The mean of the process given this state: R(t) = R Exp(−ω τ), p(t) = p − v τ + R a τ²/2 with the age τ.
  Pose relative_pose(double age_s) const;

  /// ∂(nᵀ p_map)/∂x of a point that was measured `age_s` seconds before this state. `point`: in the imu frame of this
  /// state, as moved by relative_pose. `normal`: n, map axes.
  Vector15 point_jacobian(const Vector3& point, const Vector3& normal, double age_s) const;
};

/// Spectral densities of the white noise, each axis.
struct MotionNoise {
  double angular_acceleration_density = 0.0;  ///< rad/s²/√Hz
  double jerk_density = 0.0;                  ///< m/s³/√Hz
};

/// The mean of the state `step_s` later, and its covariance. Exact for the noise of a state that does not rotate during
/// the step. Source: Barfoot, State Estimation for Robotics, section 11.1.
MotionState propagate_motion(const MotionState& state, double step_s, const MotionNoise& noise, Matrix15& covariance);

}  // namespace lodestone
