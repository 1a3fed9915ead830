#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/measurements.h"

namespace lodestone {

/// Comparison of the gyroscope with the turns of scan odometry.
struct RotationFit {
  static constexpr double least_excitation_rad_s = 0.015;
  static constexpr double least_correlation = 0.85;
  double excitation_rad_s = 0.0;  ///< rms of the LiDAR's turn rate about its mean
  double offset_s = 0.0;          ///< the IMU's stamps minus the LiDAR's, at the best correlation
  double correlation = 0.0;       ///< at that offset, 0 to 1
  double correlation_unshifted = 0.0;
  int intervals = 0;                    ///< between scans, with gyroscope samples
  double scale = 1.0;                   ///< the gyroscope's turns over the LiDAR's, at that offset
  double scale_least = 1.0;             ///< lower limit: all disagreement is the gyroscope's noise
  double scale_most = 1.0;              ///< upper limit: all disagreement is the LiDAR's noise
  double axis_error_rad = 0.0;          ///< between the turning axes of both sensors, with the given T_imu_lidar
  double axis_error_inverse_rad = 0.0;  ///< with its inverse
  /// Rotation about that axis from the given T_imu_lidar to the best fit, from small turns about the other axes
  /// (pitching and rolling).
  double turn_about_axis_rad = 0.0;
  double turn_about_axis_inverse_rad = 0.0;
  double turn_sigma_rad = M_PI;
  Quaternion R_imu_lidar = Quaternion::Identity();  ///< best fit; as given about the axis if `turn_observable` is false
  double bias_step_rad_s = 0.0;                     ///< largest step of the mean difference of gyroscope and LiDAR
  double bias_step_sigma_rad_s = 0.0;
  Time bias_step_time = 0;

  /// Sigma of the turning axis, if the disagreement is white noise from scan to scan.
  double axis_sigma_rad() const {
    const double unexplained = 1.0 - correlation * correlation;
    return intervals > 0 && correlation > 0.0 ? std::sqrt(unexplained / intervals) / correlation : M_PI;
  }

  /// True if the turns determine clock offset and turning axis.
  bool axis_observable() const {
    return excitation_rad_s > least_excitation_rad_s && correlation > least_correlation && axis_sigma_rad() < 0.02;
  }

  /// True if the rotation about the axis is also determined.
  bool turn_observable() const { return axis_observable() && turn_sigma_rad < 0.05; }
};

/// `lidar_poses`: of follow_scans. Correlates rotation vectors between scans with the gyroscope's at shifts up to ± 5
/// s, after the best rotation between the frames. Thus extrinsics, biases and scale do not affect the offset. Nothing
/// if there are fewer than 20 intervals.
std::optional<RotationFit> fit_rotation(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu,
                                        const Quaternion& R_imu_lidar);

}  // namespace lodestone
