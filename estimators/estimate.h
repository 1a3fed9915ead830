#pragma once

#include "core/geometry/nav_state.h"
#include "core/time.h"

namespace lodestone {

enum class Health {
  good,
  degenerate,  ///< at least one direction not seen by LiDAR
  lost         ///< the estimate can no longer be trusted
};

/// What one step saw: a row of diagnostics.csv.
struct Diagnostics {
  int points = 0;             ///< points used after downsampling
  int correspondences = 0;    ///< points that found their plane
  double inlier_share = 0.0;  ///< correspondences / points
  double lidar_rmse_m = 0.0;  ///< weighted point-to-plane rms residual
  double lidar_nis = 0.0;     ///< mean of r² over its variance a correspondence; 0: none
  /// Predicted sigma of each direction of the degeneracy analysis, smallest information last; metres, rotations
  /// brought to metres by the lever arm. Infinite where nothing was seen.
  Vector6 direction_sigma_m = Vector6::Zero();
  Vector6 direction_weight = Vector6::Ones();  ///< share of LiDAR kept per direction: 1 keeps it, 0 masks it
  int degenerate_directions = 0;
  int magnetic_samples = 0;           ///< array samples of this step that met the map
  int magnetic_rejected = 0;          ///< of these, with a Huber weight below one half
  int magnetic_off_map = 0;           ///< single readings without field in the map
  int magnetic_set_aside = 0;         ///< single readings that the rest of their array contradicts
  double magnetic_weight = 0.0;       ///< mean Huber weight
  double magnetic_shrink = 1.0;       ///< β in force
  double magnetic_residual_ut = 0.0;  ///< rms of measured minus map at the estimate
  double magnetic_nis = 0.0;  ///< of the array samples at the prediction: mean of rᵀ S⁻¹ r per component; 0: none
  double clock_offset_s = 0.0;  ///< how late the magnetometers' stamps are
  double clock_sigma_s = 0.0;   ///< of it; 0: not estimated
  double place_share = 0.0;  ///< of the scan's points above the floor: those where the cloud map has something
  double decoy_share = 0.0;  ///< the same at places where the robot is not
  int place_points = 0;      ///< such points; 0: not judged
  double field_odds = 0.0;   ///< log odds of the readings at this pose against anywhere on the field map
  int iterations = 0;
  double step_ms = 0.0;  ///< wall time of the step
};

/// One pose of the output. Its time is the scan's end t_k.
struct Estimate {
  Time time = 0;
  NavState state;
  Matrix6 covariance = Matrix6::Zero();  ///< of the pose; tangent order φ (right, body), p (map)
  Diagnostics diagnostics;
  Health health = Health::good;
};

}  // namespace lodestone
