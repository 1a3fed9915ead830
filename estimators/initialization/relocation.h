#pragma once

#include "estimators/initialization/pose_search.h"

namespace lodestone {

/// A better start than the given one, where the first scan and its readings say so: horizontally within
/// initial.search_m and in heading within initial.search_deg. `state`: that of the given start.
std::optional<Pose> better_start(const EstimatorInput& input, const Keyframe& keyframe, const NavState& state);

/// Where the robot is along directions of which the prediction knows too little for a linearization: within three
/// sigmas of `keyframe.predicted`. Nothing where all are known well enough, or where nothing fits clearly better.
std::optional<Pose> better_place(const EstimatorInput& input, const Keyframe& keyframe, const NavState& state,
                                 const std::function<Vector3(int)>& bias_ut);

}  // namespace lodestone
