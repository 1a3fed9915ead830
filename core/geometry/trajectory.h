#pragma once

#include <optional>
#include <vector>

#include "core/geometry/pose.h"
#include "core/time.h"

namespace lodestone {

struct StampedPose {
  Time time = 0;
  Pose pose;
};

/// Poses T_map_imu in strictly increasing order of time.
using Trajectory = std::vector<StampedPose>;

/// The pose at `time` between two neighbours: position linear, rotation along the geodesic. Empty outside the
/// trajectory's span, and if the neighbours are more than `max_gap` (ns) apart.
std::optional<Pose> interpolate(const Trajectory& trajectory, Time time, Time max_gap);

}  // namespace lodestone
