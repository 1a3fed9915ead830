#pragma once

#include "core/geometry/pose.h"
#include "core/geometry/s2.h"

namespace lodestone {

/// Offsets of the tangent vector's parts: φ, p, v, b_g, b_a, g (docs/design/architecture.md).
namespace tangent {
constexpr int rotation = 0;
constexpr int position = 3;
constexpr int velocity = 6;
constexpr int gyroscope_bias = 9;
constexpr int accelerometer_bias = 12;
constexpr int gravity = 15;
constexpr int size = 17;
}  // namespace tangent

using Vector17 = Eigen::Matrix<double, 17, 1>;
using Matrix17 = Eigen::Matrix<double, 17, 17>;

/// The state of the robot at one time.
struct NavState {
  Pose T_map_imu;
  Vector3 velocity = Vector3::Zero();            ///< of imu in map axes, m/s
  Vector3 gyroscope_bias = Vector3::Zero();      ///< rad/s
  Vector3 accelerometer_bias = Vector3::Zero();  ///< m/s²
  Vector3 gravity{0.0, 0.0, -9.80665};           ///< map axes, m/s²; of fixed length

  NavState boxplus(const Vector17& delta) const {
    NavState result;
    result.T_map_imu = T_map_imu.boxplus(delta.head<6>());
    result.velocity = velocity + delta.segment<3>(tangent::velocity);
    result.gyroscope_bias = gyroscope_bias + delta.segment<3>(tangent::gyroscope_bias);
    result.accelerometer_bias = accelerometer_bias + delta.segment<3>(tangent::accelerometer_bias);
    result.gravity = s2::boxplus(gravity, delta.segment<2>(tangent::gravity));
    return result;
  }

  /// The δ with other.boxplus(δ) equal to this.
  Vector17 boxminus(const NavState& other) const {
    Vector17 delta;
    delta.head<6>() = T_map_imu.boxminus(other.T_map_imu);
    delta.segment<3>(tangent::velocity) = velocity - other.velocity;
    delta.segment<3>(tangent::gyroscope_bias) = gyroscope_bias - other.gyroscope_bias;
    delta.segment<3>(tangent::accelerometer_bias) = accelerometer_bias - other.accelerometer_bias;
    delta.segment<2>(tangent::gravity) = s2::boxminus(gravity, other.gravity);
    return delta;
  }
};

}  // namespace lodestone
