#pragma once

#include <optional>

#include "core/geometry/nav_state.h"
#include "core/time.h"

namespace lodestone {

/// How far an estimate can be trusted (docs/design/050-health.md).
enum class Health {
  good,       ///< the error is what the covariance says
  uncertain,  ///< known to worse than half a metre, or the sensors contradict the maps for a short time
  lost        ///< the estimate must not be used
};

/// Why an estimate is not good.
enum class HealthReason {
  none,
  not_finite,     ///< the state is not a number
  covariance,     ///< a sigma of the position is too large
  unobserved,     ///< for long, no sensor observes a direction that the covariance claims to know
  scan_off_map,   ///< scans do not fit the cloud map at this pose
  field_off_map,  ///< readings do not fit the magnetic map at this pose
  motion,         ///< positions move otherwise than their velocities say
  searching       ///< the estimator was lost and the position has not been found again
};

/// Statistics of one step: a row of diagnostics.csv.
struct Diagnostics {
  int points = 0;             ///< points used after downsampling
  int correspondences = 0;    ///< points with a plane
  double inlier_share = 0.0;  ///< correspondences / points
  double lidar_rmse_m = 0.0;  ///< weighted point-to-plane rms residual
  double lidar_nis = 0.0;     ///< mean of r² / variance over correspondences; 0: no correspondences
  /// Predicted sigma of each direction of the degeneracy analysis, smallest information last, in metres; rotations are
  /// converted to metres by the lever arm. Infinite for a direction without information.
  Vector6 direction_sigma_m = Vector6::Zero();
  Vector6 direction_weight = Vector6::Ones();  ///< share of LiDAR information kept in each direction; 0 masks it
  int degenerate_directions = 0;
  int unobserved_directions = 0;  ///< those that the scan alone does not observe, by one rule for all estimators
  int magnetic_samples = 0;       ///< array samples of this step with at least one reading on the map
  int magnetic_rejected = 0;      ///< array samples with a Huber weight below one half
  int magnetic_off_map = 0;       ///< single readings off the map
  int magnetic_set_aside = 0;     ///< single readings that are rejected because they contradict the rest of their array
  double magnetic_weight = 0.0;   ///< mean Huber weight
  double magnetic_shrink = 1.0;   ///< β of this step
  double magnetic_residual_ut = 0.0;  ///< rms of measured minus map at the estimate, µT
  double magnetic_nis = 0.0;    ///< mean of rᵀ S⁻¹ r per component, array samples at the predicted pose; 0: none
  double clock_offset_s = 0.0;  ///< delay of the magnetometers' stamps
  double clock_sigma_s = 0.0;   ///< sigma of the delay; 0: not estimated
  /// Share of the scan's points above the floor where the cloud map has something, at this pose and at decoy poses.
  double place_share = 0.0;
  double decoy_share = 0.0;
  int place_points = 0;        ///< such points; 0: not judged
  double field_odds = 0.0;     ///< log odds of the readings at this pose against anywhere on the field map
  double wheel_weight = -1.0;  ///< least Huber weight of the wheels' velocity; below 0: no wheels
  double wheel_slip = 0.0;     ///< estimated slip, relative to the velocity; positive: the wheels report too much
  int iterations = 0;
  double step_ms = 0.0;  ///< wall time of the step
};

/// One pose of the output. Its time is the scan's end t_k.
struct Estimate {
  Time time = 0;
  NavState state;
  Matrix6 covariance = Matrix6::Zero();  ///< of the pose; tangent order φ (right, body), p (map)
  /// Pose at which the scan fits the cloud map with the platform file's calibration: the state's pose, moved by the
  /// estimated calibration and map error. None: the state's pose.
  std::optional<Pose> scan_pose;
  Diagnostics diagnostics;
  Health health = Health::good;
  HealthReason reason = HealthReason::none;
};

/// The largest variance of an axis of the map in an estimate's covariance.
inline double position_variance_m2(const Matrix6& covariance) {
  return covariance.diagonal().tail<3>().maxCoeff();
}

}  // namespace lodestone
