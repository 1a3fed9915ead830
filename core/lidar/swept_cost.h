#pragma once

#include <span>

#include "core/imu/deskewing.h"
#include "core/lidar/condensed_cost.h"
#include "core/lidar/lidar_correction.h"

namespace lodestone {

using Vector25 = Eigen::Matrix<double, 25, 1>;
using Matrix25 = Eigen::Matrix<double, 25, 25>;

/// All point-to-plane residuals of a deskewed scan as one quadratic form in y = [ξ; η]: ξ of the condensed cost, at the
/// pose of the scan's end, and η the departure of the states at both ends of the step from the motion of deskewing
/// (Deskewing::departure). A point of age t has r = aᵀ ξ + w (p × Rᵀn)ᵀ turn + nᵀ (Hermite cubic of the rest), w = t /
/// step. The noise of the IMU between both ends, given the states there, is marginalized by its first Karhunen-Loève
/// modes: a Brownian bridge for the gyroscope, the bridge of an integrated Brownian motion for the accelerometer
/// (docs/design/008).
struct SweptCost {
  Matrix25 given_both = Matrix25::Zero();  ///< the moment of y, given the states at both ends of the step
  Matrix25 given_end = Matrix25::Zero();   ///< given the scan's end alone: only the slope at the end remains of η
};

/// Errors that the map's points share. Left and right of the robot are measured at different times, so such errors also
/// look like motion within the scan; the information about this motion is reduced accordingly.
struct SharedMapError {
  Matrix6 pose_covariance = Matrix6::Zero();  ///< of the pose due to them; φ in map axes, p

  /// The points were displaced as the map is (BentMapFit), such that their least squares give the best pose. Motion
  /// that the map's errors pretend must not give another one: the cost is moved back to it.
  bool straightened = false;
};

/// `cost`: condensed from the same correspondences at the same pose.
SweptCost sweep(const CondensedCost& cost, std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                const Deskewing& deskewing, const SharedMapError& map_error = {});

/// Information about the error of the IMU over a whole step, backwards from the scan's end: turn, shift, slope; 9×9.
Eigen::Matrix<double, 9, 9> step_information(const Deskewing& deskewing);

/// A scan as the window uses it: the quadratic forms of its points, and the motion of deskewing.
struct CondensedScan {
  CondensedCost cost;
  SweptCost swept;
  Deskewing deskewing;
  LidarCorrection correction{};              ///< calibration that moved the points to the imu frame
  Vector3 beam_origin_m = Vector3::Zero();   ///< of the first LiDAR, imu frame; corrections rotate points about it
  Matrix6 map_error_root = Matrix6::Zero();  ///< L: the map's shared error has covariance L Lᵀ (φ in map axes, p)
  Matrix6 long_map_error_root = Matrix6::Zero();  ///< the same for errors over tens of metres, which are not estimated
  double long_map_error_length_m = 1.0;           ///< the length of the way over which these change
  bool by_lidar = false;  ///< false: the points are not from a LiDAR, calibration does not move them
};

/// Ages of points are those of the correspondences.
CondensedScan condense_scan(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                            const Deskewing& deskewing = {}, const SharedMapError& map_error = {});

}  // namespace lodestone
