#pragma once

#include <span>

#include "core/imu/deskewing.h"
#include "core/lidar/condensed_cost.h"
#include "core/lidar/lidar_correction.h"

namespace lodestone {

using Vector25 = Eigen::Matrix<double, 25, 1>;
using Matrix25 = Eigen::Matrix<double, 25, 25>;

/// All point-to-plane residuals of a deskewed scan as one quadratic form in y = [ξ; η]: ξ of the condensed cost, at the
/// pose of the scan's end, and η how the states at both ends of the step depart from the motion that the scan was
/// deskewed with (Deskewing::departure). A point of age t has r = aᵀ ξ + w (p × Rᵀn)ᵀ turn + nᵀ (Hermite cubic of the
/// rest), w = t / step. The noise of the IMU between both ends, given both, is marginalized by its first modes of
/// Karhunen and Loève: of the gyroscope a Brownian bridge, of the accelerometer the bridge of an integrated Brownian
/// motion.
struct SweptCost {
  Matrix25 given_both = Matrix25::Zero();  ///< the moment of y, given the states at both ends of the step
  Matrix25 given_end = Matrix25::Zero();   ///< given the scan's end alone: of η the slope at the end remains
};

/// `cost`: condensed from the same correspondences at the same pose. `pose_covariance`: of what errors that the map's
/// points share make of the pose (φ in map axes, p). Left and right of the robot are seen at different times: such
/// errors look like motion within the scan, too, which is then believed no better.
SweptCost sweep(const CondensedCost& cost, std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                const Deskewing& deskewing, const Matrix6& pose_covariance = Matrix6::Zero());

/// Information of the IMU's error over a whole step, back from the scan's end: turn, shift, slope; 9×9.
Eigen::Matrix<double, 9, 9> step_information(const Deskewing& deskewing);

/// A scan as the window takes it up: what its points say, and what they were deskewed with.
struct CondensedScan {
  CondensedCost cost;
  SweptCost swept;
  Deskewing deskewing;
  LidarCorrection correction{};              ///< that points were brought to the imu frame with
  Vector3 beam_origin_m = Vector3::Zero();   ///< of the first LiDAR, imu frame: its mounting turns all points about it
  Matrix6 map_error_root = Matrix6::Zero();  ///< L: the map's shared error moves the pose by L Lᵀ (φ in map axes, p)
  Matrix6 long_map_error_root = Matrix6::Zero();  ///< the same of errors over tens of metres, which are not estimated
  double long_map_error_length_m = 1.0;           ///< the way over which these change
  bool by_lidar = false;                          ///< false: the points are no LiDAR's, calibration does not move them
};

/// The points' ages are those of the correspondences.
CondensedScan condense_scan(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                            const Deskewing& deskewing = {}, const Matrix6& pose_covariance = Matrix6::Zero());

}  // namespace lodestone
