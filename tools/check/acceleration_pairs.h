#pragma once

#include <vector>

#include "core/geometry/trajectory.h"
#include "core/measurements.h"

namespace lodestone {

/// The acceleration of a way driven and the specific force of the IMU, both as weighted means over the same second or
/// so.
struct AccelerationPair {
  Time time = 0;
  Quaternion rotation;                       ///< of the pose there, imu to the poses' frame
  Vector3 acceleration = Vector3::Zero();    ///< m/s², the poses' frame
  Vector3 specific_force = Vector3::Zero();  ///< m/s², the same frame: acceleration, less gravity, plus bias
};

/// `poses`: of the imu frame, some ten a second. The second difference of positions half a second apart is that of the
/// specific force, turned by the poses and integrated twice: no differentiation of what is noisy.
std::vector<AccelerationPair> compare_accelerations(const Trajectory& poses, const std::vector<ImuSample>& imu);

/// The turn about the vertical between the accelerations of LiDAR and IMU.
struct HeadingFit {
  double turn_rad = 0.0;
  double correlation = 0.0;      ///< after that turn, of the horizontal parts
  double excitation_m_s2 = 0.0;  ///< rms of the LiDAR's horizontal acceleration about its mean

  bool tells() const { return correlation > 0.85 && excitation_m_s2 > 0.1; }
};

/// `lidar_poses`: T_start_lidar. Zeros where there are too few.
HeadingFit fit_heading(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu, const Quaternion& R_imu_lidar);

}  // namespace lodestone
