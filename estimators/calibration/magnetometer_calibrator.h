#pragma once

#include <string>
#include <vector>

#include "core/observability/parameter_gain.h"
#include "estimators/calibration/field_change.h"

namespace lodestone {

/// The estimated calibration of one magnetometer.
struct CalibratedMagnetometer {
  MagnetometerCalibration calibration;  ///< to be applied to readings as they are in the log
  CalibrationParameters sigma =
      CalibrationParameters::Zero();  ///< sigmas of hard iron (µT) and the nine numbers of the distortion
  CalibrationParameters hidden_share =
      CalibrationParameters::Zero();  ///< share of each parameter (0 to 1) that is kept at its prior
  std::size_t readings = 0;           ///< number of 50 ms medians
  double before_ut = 0.0;             ///< rms residual per component of the readings as they are, against the reference
  double after_ut = 0.0;              ///< the same, calibrated
  double sigma_scale = 1.0;           ///< scatter of residuals that neighbours share, relative to the white noise
  Vector3 usual_field_ut = Vector3::Zero();  ///< mean of the reference over the log, magnetometer axes
  Vector3 usual_error_ut = Vector3::Zero();  ///< error of the reading in the usual field
  Vector3 usual_error_sigma_ut = Vector3::Zero();
  Matrix3 usual_error_covariance_ut2 = Matrix3::Zero();
};

struct MagnetometerCalibrationResult {
  std::vector<CalibratedMagnetometer> magnetometers;  ///< in the order of the suite
  std::vector<std::string> held;  ///< text, one line per kind of parameter that the motion does not determine
  FieldProcess process;
  FieldChange field_change;                        ///< with a map
  Vector3 gyroscope_bias_rad_s = Vector3::Zero();  ///< without a map
  std::size_t moments = 0;
  double duration_s = 0.0;
  double turned_deg = 0.0;    ///< sum of the rotations between moments
  bool offsets_only = false;  ///< without a map: the field changed too fast to estimate distortions
  int rounds = 0;
  ParameterGain gain;          ///< of the magnetometers with readings
  Eigen::MatrixXd covariance;  ///< of their parameters, 12 each: b, then the nine numbers of D
};

/// Estimates hard iron, soft iron and misalignment of each magnetometer (docs/design/025-magnetometer-calibration.md).
/// The reference is the map at each magnetometer's pose, whose error is constant over its correlation length. Without a
/// map, the reference is the field that all magnetometers read together: it rotates with the gyroscope, changes as a
/// random walk while the robot moves, and has a gradient across the array.
///
/// With a map, deviations that all magnetometers share are attributed to the map: a scale and an offset of the field in
/// map axes, with a size estimated from the log, and single places. If scale and offset are significant, their prior is
/// wide: what cannot be distinguished from errors of all magnetometers is attributed to the map and increases the
/// sigmas.
///
/// Each round solves for parameters and field together and then recomputes the weights: random walk of the field,
/// scatter of each magnetometer. A direction for which the information of the log, in units of the prior, is below
/// options.min_gain is kept at its prior (parameter_gain.h). Without a map, if the field's walk exceeds
/// options.max_walk_ut_sqrt_s, the information about distortions is ignored: near steel, the curvature of the field is
/// correlated with the field like a distortion, and the model lacks it. Throws InputError if the log has fewer than 20
/// moments.
MagnetometerCalibrationResult calibrate_magnetometers(const CalibrationLog& log, const CalibrationOptions& options);

}  // namespace lodestone
