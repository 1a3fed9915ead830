#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/measurements.h"

namespace lodestone {

/// The gyroscope held against the turns that the scans show.
struct RotationFit {
  static constexpr double least_excitation_rad_s = 0.015;
  double excitation_rad_s = 0.0;  ///< rms of the LiDAR's turn rate about its mean
  double offset_s = 0.0;          ///< the IMU's stamps less the LiDAR's, where both agree best
  double correlation = 0.0;       ///< there, 0 to 1
  double correlation_unshifted = 0.0;
  int intervals = 0;                    ///< between scans, that the gyroscope has there, too
  double scale = 1.0;                   ///< the gyroscope's turns over the LiDAR's, there
  double scale_least = 1.0;             ///< were all that they do not agree on the gyroscope's noise
  double scale_most = 1.0;              ///< were it all the LiDAR's
  double axis_error_rad = 0.0;          ///< between the axes of turning that both see, with T_imu_lidar as given
  double axis_error_inverse_rad = 0.0;  ///< with its inverse
  /// About that axis, by the little turns about the others (a robot's swaying): from T_imu_lidar as given to what both
  /// see.
  double turn_about_axis_rad = 0.0;
  double turn_about_axis_inverse_rad = 0.0;
  double turn_sigma_rad = M_PI;
  Quaternion R_imu_lidar =
      Quaternion::Identity();    ///< that both see: about the axis as given where `tells_turn` does not hold
  double bias_step_rad_s = 0.0;  ///< largest step of the gyroscope's mean difference from the LiDAR
  double bias_step_sigma_rad_s = 0.0;
  Time bias_step_time = 0;

  /// One sigma of the axis about which both turn, as far as what they do not agree on is noise from one scan to the
  /// next.
  double axis_sigma_rad() const {
    const double unexplained = 1.0 - correlation * correlation;
    return intervals > 0 && correlation > 0.0 ? std::sqrt(unexplained / intervals) / correlation : M_PI;
  }

  /// Whether there is turning enough to tell anything.
  bool tells() const {
    return excitation_rad_s > least_excitation_rad_s && correlation > 0.85 && axis_sigma_rad() < 0.02;
  }

  /// Whether the turn about the axis is known, too.
  bool tells_turn() const { return tells() && turn_sigma_rad < 0.05; }
};

/// `lidar_poses`: of follow_scans. Correlates rotation vectors between scans with the gyroscope's at every shift up
/// to ± 5 s, after the best rotation between the two frames: neither extrinsics nor biases nor scale have a say in the
/// offset. Nothing where there are fewer than 20 intervals.
std::optional<RotationFit> fit_rotation(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu,
                                        const Quaternion& R_imu_lidar);

}  // namespace lodestone
