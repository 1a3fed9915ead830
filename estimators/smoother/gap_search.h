#pragma once

#include "estimators/smoother/pose_search.h"

namespace lodestone {

/// Whether no direction of the position is known to within reach of a linearization, as after seconds without scans.
/// `covariance`: order φ, p. Where some direction is known, Relocation searches along the others.
bool is_adrift(const Matrix6& covariance);

/// Of a place that find_after_gap found (φ right, p map), for the gate of the association.
Matrix6 covariance_after_gap();

/// The place of a keyframe whose prediction `about` is adrift. The scan is registered from a grid of starts over three
/// sigmas of `covariance` (φ right, p map), and each place found is weighed with the scan, the readings and the
/// prediction. Empty unless one place has a probability above `min_probability`, among all and "nowhere on the map";
/// and if the grid is too large: then only the search of the whole map helps. `background`: of the whole field map,
/// called only if there are readings.
std::optional<Pose> find_after_gap(const PoseSearch& search, const Pose& about, const Matrix6& covariance,
                                   double min_probability, const std::function<FieldBackground()>& background);

}  // namespace lodestone
