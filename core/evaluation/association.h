#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/trajectory.h"

namespace lodestone {

/// An estimated pose and the ground truth at the same time, both T_map_imu.
struct PosePair {
  Time time = 0;  ///< the estimate's stamp
  Pose estimate;
  Pose truth;
  std::size_t estimate_index = 0;  ///< index into the estimated trajectory
};

/// Pairs in order of time.
using PosePairs = std::vector<PosePair>;

/// Pairs every pose of the shorter trajectory with the nearest stamp of the longer one. A pair is kept if its stamps
/// differ by at most `max_difference`. If both have the same length, the estimate counts as the longer one.
/// A stamp of the longer trajectory may be used twice. Source: evo 1.36.5, sync.associate_trajectories.
PosePairs associate_nearest(const Trajectory& estimate, const Trajectory& truth,
                            Time max_difference = from_seconds(0.01));

/// Over longer gaps, ground truth is not interpolated.
inline constexpr double kLongestInterpolation_s = 0.25;

/// Pairs every estimated pose with the ground truth interpolated at its stamp. In a gap of the ground truth longer than
/// kLongestInterpolation_s, only poses within 10 ms of a ground-truth pose are paired: some ground truths have one pose
/// per scan. Poses outside the span of the ground truth have no pair.
PosePairs associate_interpolated(const Trajectory& estimate, const Trajectory& truth);

/// The ground truth interpolated at `times`, without times at which associate_interpolated finds none.
Trajectory truth_at(const std::vector<Time>& times, const Trajectory& truth);

}  // namespace lodestone
