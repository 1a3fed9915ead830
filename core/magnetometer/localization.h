#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

struct MagneticLocalizationOptions {
  FieldInterpolation interpolation = FieldInterpolation::bilinear;
  bool map_sigma = true;  ///< a reading's variance is the sensor's plus the map's; false: the sensor's alone
  int max_iterations = 20;
  double step_tolerance = 1e-4;  ///< converged if no longer step, in prior sigmas, lowers the cost
  double unseen_gain = 0.1;      ///< a direction is unobservable if field information × prior variance is below this
};

/// One magnetometer's reading, for localization.
struct LocalizationReading {
  Pose T_imu_mag;  ///< transforms points in the magnetometer's frame at the reading's time to the imu frame of the
                   ///< estimated pose
  Vector3 measured_ut = Vector3::Zero();  ///< minus its bias, magnetometer axes
  double variance_ut2 = 1.0;              ///< of a component; with options.map_sigma the map's variance is added
};

/// Estimate of the pose from one array sample.
struct MagneticLocalization {
  Pose T_map_imu;  ///< at the sample's time
  /// Σ Jᵀ J / σ² at the result, order φ, p: the field's information alone. Singular if the field is uniform.
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();  ///< Σ Jᵀ r / σ² at the result: the field's alone; with a prior not zero
  /// (information + prior⁻¹)⁻¹: of T_map_imu, prior included.
  Matrix6 covariance = Matrix6::Zero();
  /// Columns: directions of the tangent space, each one prior sigma long, independent under the prior; sorted by
  /// falling gain.
  Matrix6 directions = Matrix6::Identity();
  /// Of each: prior variance over the field's own variance. Along a direction below options.unseen_gain the result is
  /// the prediction.
  Vector6 gain = Vector6::Zero();
  double residual_rms_ut = 0.0;  ///< of measured minus map over the readings used, per component
  int used = 0;                  ///< readings with field
  int off_map = 0;               ///< readings without field, discarded
  int iterations = 0;
  bool converged = false;
};

/// Magnetic localization of one array sample (eq:mag_loc_estimate) by Gauss-Newton with a line search, from the
/// prediction and with the prediction as a prior (docs/design/equations.md). Directions that the field does not observe
/// keep the prediction instead of fitting noise. A step never moves a used reading off the map.
/// `predicted`: T_map_imu at the sample's time. `prior`: its covariance, order φ (right), p (map). `bias_ut`: for each
/// magnetometer, in its frame, subtracted from the readings; empty: none. If no reading is on the map, the result is
/// the prediction, not converged. Throws std::invalid_argument if the prior is not positive definite or sizes disagree
/// with the suite.
MagneticLocalization localize(const Pose& predicted, const Matrix6& prior, const MagneticArraySample& sample,
                              const SensorSuite& suite, const MagneticMap& map,
                              const MagneticLocalizationOptions& options, std::span<const Vector3> bias_ut = {});

/// The same for readings with individual variances, and for a pose at another time than theirs.
MagneticLocalization localize(const Pose& predicted, const Matrix6& prior,
                              std::span<const LocalizationReading> readings, const MagneticMap& map,
                              const MagneticLocalizationOptions& options);

}  // namespace lodestone
