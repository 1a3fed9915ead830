#pragma once

#include <optional>
#include <span>

#include "core/geometry/nav_state.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The wheels' samples between two scans as one measurement of the state at the scan's end t_k. The IMU relates each
/// sample to t_k. The mean velocity of the wheel frame, in its axes, is
///   u = by_velocity (Rᵀ v) + by_gyroscope_bias b_g + rest.
struct WheelReading {
  Vector3 measured_m_s = Vector3::Zero();       ///< mean velocity; z, and y of a non-holonomic robot, are 0
  Vector3 inverse_sigma_s_m = Vector3::Zero();  ///< 1 / σ of each component; 0: the component is unknown
  Matrix3 by_velocity = Matrix3::Zero();        ///< mean of R_wheels_imu R_t_end
  Matrix3 by_gyroscope_bias = Matrix3::Zero();  ///< m
  Vector3 rest = Vector3::Zero();  ///< m/s, of the motion between the samples and t_k, and of the lever arm
  int samples = 0;
  bool standstill = false;  ///< the wheels stand still: the velocity is zero in all directions

  /// u at a state.
  Vector3 expected_m_s(const Quaternion& R_map_imu, const Vector3& velocity, const Vector3& gyroscope_bias) const {
    return by_velocity * (R_map_imu.conjugate() * velocity) + by_gyroscope_bias * gyroscope_bias + rest;
  }
};

/// Averages `samples` of one scan. `end`: state at the last IMU sample's time, at which `rest` is linearized. `imu`:
/// samples of the same interval. Empty if there are no samples or fewer than two IMU samples.
std::optional<WheelReading> average_wheels(std::span<const WheelSample> samples, const NavState& end,
                                           std::span<const ImuSample> imu, const WheelModel& model);

}  // namespace lodestone
