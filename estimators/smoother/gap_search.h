#pragma once

#include "estimators/smoother/pose_search.h"

namespace lodestone {

/// One sigma, within reach of a linearization.
inline constexpr double kKnown_m = 0.12;

/// Whether a keyframe has a scan, and no direction of its predicted position is known to kKnown_m, as after seconds
/// without scans. Where some direction is known, Relocation searches along the others.
bool is_adrift(const Keyframe& keyframe);

/// Of a place that find_after_gap found (φ right, p map), for the gate of the association.
Matrix6 covariance_after_gap();

/// The place of a keyframe whose prediction `about` is adrift. The scan is registered from a grid of starts over three
/// sigmas of `covariance` (φ right, p map), and each place found is weighed with the scan, the readings and the
/// prediction. Empty unless one place has a probability above `min_probability`, among all and "nowhere on the map";
/// and if the grid is too large: then only the search of the whole map helps. `background`: of the whole field map,
/// called only if there are readings.
std::optional<Pose> find_after_gap(const PoseSearch& search, const Pose& about, const Matrix6& covariance,
                                   double min_probability, const std::function<FieldBackground()>& background);

/// Removes the points of a scan whose place is not known, with a warning (null: none).
void leave_out_scan(Keyframe& keyframe, WarningLog* warnings);

}  // namespace lodestone
