#pragma once

#include <string>
#include <vector>

#include "core/observability/parameter_gain.h"
#include "estimators/calibration/field_change.h"

namespace lodestone {

/// What a log says of one magnetometer.
struct CalibratedMagnetometer {
  MagnetometerCalibration calibration;  ///< of readings as the log gave them
  CalibrationParameters sigma =
      CalibrationParameters::Zero();  ///< of hard iron (µT) and the nine numbers of the distortion
  CalibrationParameters hidden_share =
      CalibrationParameters::Zero();  ///< of each: how much of it (0 to 1) was held at its prior
  std::size_t readings = 0;           ///< medians of 50 ms
  double before_ut = 0.0;             ///< rms of a component: readings as they are against the reference
  double after_ut = 0.0;              ///< and calibrated
  double sigma_scale = 1.0;           ///< how much more they scatter, alike for neighbours, than their white noise
  Vector3 usual_field_ut = Vector3::Zero();  ///< mean of the reference over the log, magnetometer axes
  Vector3 usual_error_ut = Vector3::Zero();  ///< what it reads beside the field where the field is usual
  Vector3 usual_error_sigma_ut = Vector3::Zero();
  Matrix3 usual_error_covariance_ut2 = Matrix3::Zero();
};

struct MagnetometerCalibrationResult {
  std::vector<CalibratedMagnetometer> magnetometers;  ///< in the order of the suite
  std::vector<std::string> held;  ///< in words, one a kind of parameter: what the motion does not show
  FieldProcess process;
  FieldChange field_change;                        ///< with a map
  Vector3 gyroscope_bias_rad_s = Vector3::Zero();  ///< without a map
  std::size_t moments = 0;
  double duration_s = 0.0;
  double turned_deg = 0.0;    ///< sum of the turns between moments
  bool offsets_only = false;  ///< without a map: the field changed too fast for distortions to be told from its slopes
  int rounds = 0;
  ParameterGain gain;          ///< of the magnetometers with readings
  Eigen::MatrixXd covariance;  ///< of their parameters, 12 each: b, then the nine numbers of D
};

/// Hard iron, soft iron and misalignment of each magnetometer. The reference is the map at each one's pose, whose error
/// is one and the same over its correlation length; or, without a map, the field that all read together: it turns back
/// as the gyroscope turns, changes as a random walk while the robot moves, and has a slope across the array.
///
/// With a map, what all magnetometers share is the map's: a scale and an offset of the field in map axes, of a size
/// that the log shows, and places that stand out. If scale and offset are significant, their prior is wide, so that
/// what does not distinguish them from errors of all magnetometers stays with the map, and widens the sigmas.
///
/// Each round solves for parameters and field together, and then weighs anew: how far the field walks, how much each
/// magnetometer scatters. What the information of the log, in units of the prior, leaves below options.min_gain is held
/// at its prior (parameter_gain.h). Without a map, where the field walks by more than options.max_walk_ut_sqrt_s, that
/// of the distortions is not believed: near steel the field's curvature, which the model lacks, goes with the field as
/// a distortion would. Throws InputError where the log has fewer than 20 moments.
MagnetometerCalibrationResult calibrate_magnetometers(const CalibrationLog& log, const CalibrationOptions& options);

}  // namespace lodestone
