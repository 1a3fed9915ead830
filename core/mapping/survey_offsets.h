#pragma once

#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

/// Offsets of the magnetometers of a survey, by FieldObservation::magnetometer: the constant error of each in its own
/// axes, µT, that is remaining hard iron, and what a wrong tilt makes of the vertical field. Empty if no magnetometer
/// is known.
///
/// Least squares over places that were passed more than once: the mean reading of pass i of magnetometer m through
/// voxel v is y_i = B_v + S_v (x_i - x_v) + R_i b_m + e_i. The field B_v and slopes S_v of the voxel are eliminated, so
/// that only differences between passes count; large residuals have Huber weights. The prior sigma of each component
/// of b is `offset_sigma_ut`, above 0. A component that the passes do not show stays near zero: a vertical offset that
/// all magnetometers share on a flat floor becomes part of the map. docs/design/059
std::vector<Vector3> survey_offsets(const std::vector<FieldObservation>& observations, double offset_sigma_ut);

/// The observations without these offsets; magnetometers without one are unchanged.
std::vector<FieldObservation> without_offsets(std::vector<FieldObservation> observations,
                                              const std::vector<Vector3>& offsets_ut);

/// Mean square of a component of the offsets, µT²; 0 without any.
double mean_square_offset(const std::vector<Vector3>& offsets_ut);

}  // namespace lodestone
