#pragma once

#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

/// Errors of a survey's magnetometers that its own passes show.
struct SurveyErrors {
  /// By FieldObservation::magnetometer: the constant error of each in its own axes, µT, that is remaining hard iron,
  /// and what a wrong tilt makes of the vertical field. Empty: nothing to subtract.
  std::vector<Vector3> offsets_ut;
  double clock_s = 0.0;        ///< of all magnetometers: stamp minus the trajectory's time of the same instant
  double clock_sigma_s = 0.0;  ///< 0: not estimated
};

/// Prior sigmas; 0: not estimated.
struct SurveyErrorSigmas {
  double offset_ut = 0.0;
  double clock_s = 0.0;
};

/// Least squares over places that were passed more than once: the mean reading of pass i of magnetometer m through
/// voxel v is y_i = B_v + S_v (x_i - x_v) + R_i b_m - τ D_i + e_i, where D_i is the rate of change of the readings
/// along the pass and τ the clock's offset. The field B_v and slopes S_v of the voxel are eliminated, so that only
/// differences between passes count; large residuals have Huber weights. What the passes do not show stays near zero: a
/// vertical offset that all magnetometers share on a flat floor becomes part of the map. docs/design/059
SurveyErrors survey_errors(const std::vector<FieldObservation>& observations, const SurveyErrorSigmas& sigmas);

/// The observations without these errors: at the poses that the trajectory has at the corrected times, which are those
/// of the same magnetometer's other observations, interpolated. Observations of unknown magnetometers are unchanged.
std::vector<FieldObservation> without_errors(std::vector<FieldObservation> observations, const SurveyErrors& errors);

/// Mean square of a component of the offsets, µT²; 0 without any.
double mean_square_offset(const std::vector<Vector3>& offsets_ut);

}  // namespace lodestone
