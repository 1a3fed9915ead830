#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/map_error.h"
#include "core/lidar/plane_map.h"
#include "core/measurements.h"
#include "core/observability/degeneracy.h"
#include "core/wheels/wheel_reading.h"
#include "estimators/estimate.h"
#include "factors/condensed_lidar_factor.h"
#include "factors/field_factor.h"

namespace lodestone {

/// Measurements and intermediate results of a keyframe, beside its variables.
struct Keyframe {
  Time scan_start = 0;
  std::vector<ImuSample> imu;      ///< over this scan's bundle
  ImuNoise imu_noise;              ///< of these samples
  std::vector<LidarPoint> points;  ///< sampled, frame of the first LiDAR, own times
  std::vector<MagneticArraySample> magnetic;
  std::vector<WheelSample> wheel_samples;
  Pose predicted;                                      ///< pose at which field readings are weighted
  Matrix6 predicted_covariance = Matrix6::Identity();  ///< of `predicted`, before this scan's measurements (φ, p)
  Matrix6 gate_covariance = Matrix6::Identity();       ///< pose covariance of the association gate
  double variance_scale = 1.0;  ///< residual variance of the log over the modelled variance of sensor and plane
  std::shared_ptr<const PlaneMap> planes;  ///< that correspondences refer to
  std::vector<Correspondence> correspondences;
  bool motion_waits = false;  ///< correspondences are rough: no information about motion within the scan is used yet
  LidarCorrection lidar_correction;     ///< correction of the LiDAR calibration that the scan is transformed with
  Vector6 map_error = Vector6::Zero();  ///< error of the cloud map at this keyframe (φ in map axes, p)
  double map_error_variance_m2 = 0.0;   ///< of a cube of the map
  MapErrorVariances long_map_error_variances_m2 = MapErrorVariances::Zero();  ///< of displacements over tens of metres
  bool map_is_compared = false;                                               ///< the log has told the errors above
  CondensedScan lidar;
  Matrix6 lidar_information = Matrix6::Zero();  ///< without spurious information from noisy normals
  Matrix6 seen_share = Matrix6::Identity();     ///< share of the scan's information about a motion that is not spurious
  Matrix6 unit_hessian = Matrix6::Zero();       ///< Σ JᵀJ with unit weight on metres; only for the paper's rule
  std::vector<FieldReading> field_readings;     ///< with their last weights
  double field_variance_ut2 = 0.0;              ///< of the shared field error, per reading (FieldError)
  std::optional<WheelReading> wheels;           ///< at the prediction, with its weights; none: no samples
  double slip_jump = 0.0;                       ///< of the wheels at this keyframe, relative to the velocity
  Degeneracy degeneracy;
  Pose associated;    ///< pose of the scan in the map at the last association
  Pose analysed;      ///< pose at which the degeneracy was analysed
  Estimate estimate;  ///< diagnostics are filled while the scan is processed

  /// Whether `seen` is further than `distance_m` or `angle_deg` from the pose of the last association.
  bool moved(const Pose& seen, double distance_m, double angle_deg) const {
    const Vector6 step = seen.boxminus(associated);
    return step.tail<3>().norm() > distance_m || step.head<3>().norm() > angle_deg * M_PI / 180.0;
  }
};

}  // namespace lodestone
