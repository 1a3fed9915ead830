#pragma once

#include "core/sensor_suite.h"

namespace lodestone {

/// Sigma of a magnetometer's height against the layer of a field map with one layer
/// (docs/design/017-height-without-cloud-map.md).
constexpr double kLayerHeightSigma_m = 0.02;

/// Mean position of the magnetometers, imu frame, metres. The suite must have one.
inline Vector3 array_center(const SensorSuite& suite) {
  Vector3 sum = Vector3::Zero();
  for (const MagnetometerModel& magnetometer : suite.magnetometers) sum += magnetometer.T_imu_mag.position;
  return sum / static_cast<double>(suite.magnetometers.size());
}

/// Derivative of the height of a point of the robot by the pose (φ, p), where φ turns in the imu frame.
inline Eigen::Matrix<double, 1, 6> height_by_pose(const Pose& T_map_imu, const Vector3& point_imu) {
  Eigen::Matrix<double, 1, 6> result = Eigen::Matrix<double, 1, 6>::Zero();
  result.head<3>() = -(T_map_imu.rotation.toRotationMatrix() * so3::hat(point_imu)).row(2);
  result(5) = 1.0;
  return result;
}

}  // namespace lodestone
