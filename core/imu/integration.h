#pragma once

#include "core/geometry/nav_state.h"
#include "core/measurements.h"

namespace lodestone {

/// Mean of two neighbouring samples, minus the biases: the constant input for the interval between them.
struct ImuInterval {
  double duration_s = 0.0;
  Vector3 angular_velocity = Vector3::Zero();     ///< rad/s, imu frame
  Vector3 linear_acceleration = Vector3::Zero();  ///< m/s², specific force, imu frame at mid-interval
};

inline ImuInterval make_interval(const ImuSample& first, const ImuSample& second, const Vector3& gyroscope_bias,
                                 const Vector3& accelerometer_bias) {
  return {to_seconds(second.time - first.time),
          0.5 * (first.angular_velocity + second.angular_velocity) - gyroscope_bias,
          0.5 * (first.linear_acceleration + second.linear_acceleration) - accelerometer_bias};
}

/// Moves pose and velocity over `share` of the interval, which may be negative. Midpoint rule, exact for a constant
/// angular velocity and an acceleration that is constant in the map. eq:forward_propagation with R in the velocity row;
/// with share −1 the inverse step, eq:backward_propagation.
inline void integrate(const ImuInterval& interval, const Vector3& gravity, double share, Pose& T_map_imu,
                      Vector3& velocity) {
  const double step_s = share * interval.duration_s;
  const Quaternion half_turn = so3::exp(0.5 * step_s * interval.angular_velocity);
  const Vector3 acceleration = T_map_imu.rotation * (half_turn * interval.linear_acceleration) + gravity;
  T_map_imu.position += step_s * velocity + 0.5 * step_s * step_s * acceleration;
  velocity += step_s * acceleration;
  T_map_imu.rotation = (T_map_imu.rotation * half_turn * half_turn).normalized();
}

}  // namespace lodestone
