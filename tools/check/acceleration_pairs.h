#pragma once

#include <vector>

#include "core/geometry/trajectory.h"
#include "core/measurements.h"

namespace lodestone {

/// The acceleration of the path and the specific force of the IMU, both as weighted means over the same second.
struct AccelerationPair {
  Time time = 0;
  Quaternion rotation;                       ///< attitude at that time, imu to the poses' frame
  Vector3 acceleration = Vector3::Zero();    ///< m/s², the poses' frame
  Vector3 specific_force = Vector3::Zero();  ///< m/s², the same frame: acceleration minus gravity plus bias
};

/// `poses`: of the imu frame, some ten per second. Compares the second difference of positions half a second apart with
/// that of the twice integrated specific force. Thus noisy positions need no differentiation.
std::vector<AccelerationPair> compare_accelerations(const Trajectory& poses, const std::vector<ImuSample>& imu);

/// Rotation about the vertical between the accelerations of LiDAR and IMU.
struct HeadingFit {
  double turn_rad = 0.0;
  double correlation = 0.0;      ///< of the horizontal components, after the rotation
  double excitation_m_s2 = 0.0;  ///< rms of the LiDAR's horizontal acceleration about its mean

  bool observable() const { return correlation > 0.85 && excitation_m_s2 > 0.1; }
};

/// `lidar_poses`: T_start_lidar. All zero if there are too few poses.
HeadingFit fit_heading(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu, const Quaternion& R_imu_lidar);

}  // namespace lodestone
