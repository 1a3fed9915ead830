#include "core/geometry/trajectory.h"

#include <algorithm>

namespace lodestone {

std::optional<Pose> interpolate(const Trajectory& trajectory, Time time, Time max_gap) {
  if (trajectory.empty() || time < trajectory.front().time || time > trajectory.back().time) return std::nullopt;
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), time,
                                      [](const StampedPose& pose, Time t) { return pose.time < t; });
  if (after->time == time) return after->pose;
  const auto before = after - 1;
  if (after->time - before->time > max_gap) return std::nullopt;
  const double share = to_seconds(time - before->time) / to_seconds(after->time - before->time);
  const Vector6 step = after->pose.boxminus(before->pose);
  return before->pose.boxplus(share * step);
}

}  // namespace lodestone
