#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/map_error.h"
#include "core/lidar/plane_map.h"
#include "core/measurements.h"
#include "core/observability/degeneracy.h"
#include "estimators/estimate.h"
#include "factors/condensed_lidar_factor.h"
#include "factors/field_factor.h"

namespace lodestone {

/// What a keyframe keeps beside its variables, for as long as its measurements are looked at.
struct Keyframe {
  Time scan_start = 0;
  std::vector<ImuSample> imu;      ///< over this scan's bundle
  ImuNoise imu_noise;              ///< of these samples
  std::vector<LidarPoint> points;  ///< sampled, frame of the first LiDAR, own times
  std::vector<MagneticArraySample> magnetic;
  Pose predicted;                                      ///< that readings of the field are judged at
  Matrix6 predicted_covariance = Matrix6::Identity();  ///< of it, before this scan's measurements (φ, p)
  Matrix6 gate_covariance = Matrix6::Identity();       ///< of the pose, where correspondences are looked for
  ScanAveraging averaging;                 ///< that planes' errors are counted by: what the causal estimate averaged
  double variance_scale = 1.0;             ///< by which residuals of the log exceed what sensor and plane explain
  std::shared_ptr<const PlaneMap> planes;  ///< that correspondences point into
  std::vector<Correspondence> correspondences;
  bool motion_waits = false;            ///< correspondences are rough: they say nothing of motion within the scan
  LidarCorrection lidar_correction;     ///< with which the scan is brought to the imu frame
  Vector6 map_error = Vector6::Zero();  ///< the map's error where the scan is looked for (φ in map axes, p)
  double map_error_variance_m2 = 0.0;   ///< of a cube of the map
  MapErrorVariances long_map_error_variances_m2 = MapErrorVariances::Zero();  ///< of displacements over tens of metres
  CondensedScan lidar;
  Matrix6 lidar_information = Matrix6::Zero();  ///< without what noisy normals pretend
  Matrix6 seen_share = Matrix6::Identity();     ///< what the scan sees of a motion, of what it pretends to see
  Matrix6 unit_hessian = Matrix6::Zero();       ///< Σ JᵀJ with weight one on metres; only of the paper's rule
  std::vector<FieldReading> field_readings;     ///< as they were weighed last
  double field_variance_ut2 = 0.0;              ///< of the field's error, a reading (FieldError)
  Degeneracy degeneracy;
  Pose associated;               ///< where the scan was seen in the map when correspondences were looked for
  Pose analysed;                 ///< where the degeneracy was analysed
  Estimate estimate;             ///< diagnostics, filled as the scan is worked on
  bool field_disagrees = false;  ///< of a run without LiDAR: the field's verdict at this scan

  /// Whether the scan is seen further than `distance_m` or `angle_deg` from where correspondences were looked for.
  bool moved(const Pose& seen, double distance_m, double angle_deg) const {
    const Vector6 step = seen.boxminus(associated);
    return step.tail<3>().norm() > distance_m || step.head<3>().norm() > angle_deg * M_PI / 180.0;
  }
};

}  // namespace lodestone
