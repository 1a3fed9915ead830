#pragma once

#include <optional>

#include "core/geometry/trajectory.h"
#include "frontends/checks/finding.h"
#include "frontends/checks/log_sample.h"

namespace lodestone {

/// The gyroscope held against the turns that the scans show.
struct RotationFit {
  double excitation_rad_s = 0.0;  ///< rms of the LiDAR's turn rate about its mean
  double offset_s = 0.0;          ///< the IMU's stamps less the LiDAR's, where both agree best
  double correlation = 0.0;       ///< there, 0 to 1
  double correlation_unshifted = 0.0;
  double scale = 1.0;                   ///< the gyroscope's turns over the LiDAR's, there
  double axis_error_rad = 0.0;          ///< between the axes of turning that both see, with T_imu_lidar as given
  double axis_error_inverse_rad = 0.0;  ///< with its inverse
  double bias_step_rad_s = 0.0;         ///< largest step of the gyroscope's mean difference from the LiDAR
  double bias_step_sigma_rad_s = 0.0;
  Time bias_step_time = 0;

  /// Whether there is turning enough to tell anything.
  bool tells() const { return excitation_rad_s > 0.03 && correlation > 0.85; }
};

/// `lidar_poses`: of follow_scans. Correlates rotation vectors between scan ends with the gyroscope's at every shift up
/// to ± 5 s, after the best rotation between the two frames: neither extrinsics nor biases nor scale have a say in the
/// offset. Nothing where there are fewer than 20 intervals.
std::optional<RotationFit> fit_rotation(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu,
                                        const Quaternion& R_imu_lidar);

/// Offset of clocks, unit of the turn rate, direction of T_imu_lidar, a step of the gyroscope's bias. Of a further LiDAR (its
/// index above 0) what concerns itself alone.
Findings check_rotation(const std::optional<RotationFit>& fit, const Platform& platform, std::size_t lidar = 0);

}  // namespace lodestone
