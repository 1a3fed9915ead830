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
  double step_tolerance = 1e-4;  ///< converged when no step longer than this, in prior sigmas, lowers the cost
  double unseen_gain = 0.1;      ///< a direction is unseen where field information × prior variance is below this
};

/// One magnetometer's reading as the localization takes it.
struct LocalizationReading {
  Pose T_imu_mag;  ///< takes points in the magnetometer's frame at the reading's time to the imu frame of the pose
                   ///< sought
  Vector3 measured_ut = Vector3::Zero();  ///< less its bias, magnetometer axes
  double variance_ut2 = 1.0;              ///< of a component; with options.map_sigma the map's comes on top
};

/// What one array sample says of the pose.
struct MagneticLocalization {
  Pose T_map_imu;  ///< at the sample's time
  /// Σ Jᵀ J / σ² at the result, order φ, p: the field's information alone. Singular where the field is uniform.
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();  ///< Σ Jᵀ r / σ² at the result: the field's alone, not zero beside a prior
  /// (information + prior⁻¹)⁻¹: of T_map_imu, prior included.
  Matrix6 covariance = Matrix6::Zero();
  /// Columns: directions of the tangent space, each one prior sigma long and independent of each other under the prior;
  /// best seen first.
  Matrix6 directions = Matrix6::Identity();
  Vector6 gain = Vector6::Zero();          ///< of each: prior variance over the field's own variance
  int unseen = 0;                          ///< the last so many directions: there the result is the prediction
  double residual_rms_ut = 0.0;            ///< of measured minus map over the readings used, a component
  double predicted_residual_rms_ut = 0.0;  ///< the same at the prediction
  int used = 0;                            ///< readings with field
  int off_map = 0;                         ///< readings without field, left out
  int iterations = 0;
  bool converged = false;
};

/// Magnetic localization of one array sample (eq:mag_loc_estimate) by Gauss-Newton with a line search, from the
/// prediction and with it as a prior (docs/design/architecture.md): directions that the field does not see stay where
/// they were predicted instead of taking up noise, and are reported. A step never takes a used reading off the map.
/// `predicted`: T_map_imu at the sample's time. `prior`: its covariance, order φ (right), p (map).
/// `bias_ut`: per magnetometer, in its frame, taken off the readings; empty: none.
/// With no reading on the map the result is the prediction, not converged.
/// Throws std::invalid_argument where the prior is not positive definite or sizes disagree with the suite.
MagneticLocalization localize(const Pose& predicted, const Matrix6& prior, const MagneticArraySample& sample,
                              const SensorSuite& suite, const MagneticMap& map,
                              const MagneticLocalizationOptions& options, std::span<const Vector3> bias_ut = {});

/// The same from readings that each bring their own variance, and of a pose at another time than theirs.
MagneticLocalization localize(const Pose& predicted, const Matrix6& prior,
                              std::span<const LocalizationReading> readings, const MagneticMap& map,
                              const MagneticLocalizationOptions& options);

}  // namespace lodestone
