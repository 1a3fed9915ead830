#include "core/evaluation/association.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lodestone {

namespace {

/// A stamp as evo stores it: seconds since 1970 in a double, with a resolution of 0.24 µs. In files with stamps of
/// 100 µs, two stamps are often equally near. Then this rounding decides, and evo's figures depend on it.
double rounded_seconds(Time time) {
  return static_cast<double>(static_cast<long double>(time) / 1e9L);
}

double difference(Time a, Time b) {
  return std::abs(rounded_seconds(a) - rounded_seconds(b));
}

/// Index of the stamp nearest to `time`. Of two equally near stamps, the earlier one is chosen.
std::size_t nearest(const Trajectory& trajectory, Time time) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), time,
                                      [](const StampedPose& pose, Time t) { return pose.time < t; });
  const auto index = static_cast<std::size_t>(after - trajectory.begin());
  if (index == 0) return 0;
  if (index == trajectory.size()) return index - 1;
  return difference(trajectory[index].time, time) < difference(trajectory[index - 1].time, time) ? index : index - 1;
}

}  // namespace

PosePairs associate_nearest(const Trajectory& estimate, const Trajectory& truth, Time max_difference) {
  PosePairs pairs;
  if (estimate.empty() || truth.empty()) return pairs;
  const bool truth_is_longer = truth.size() > estimate.size();
  const Trajectory& shorter = truth_is_longer ? estimate : truth;
  const Trajectory& longer = truth_is_longer ? truth : estimate;
  for (std::size_t i = 0; i < shorter.size(); ++i) {
    const std::size_t j = nearest(longer, shorter[i].time);
    if (difference(longer[j].time, shorter[i].time) > to_seconds(max_difference)) continue;
    const std::size_t estimate_index = truth_is_longer ? i : j;
    const std::size_t truth_index = truth_is_longer ? j : i;
    pairs.push_back(
        {estimate[estimate_index].time, estimate[estimate_index].pose, truth[truth_index].pose, estimate_index});
  }
  return pairs;
}

PosePairs associate_interpolated(const Trajectory& estimate, const Trajectory& truth) {
  constexpr Time kNear = 10'000'000;
  constexpr Time kLongestGap = from_seconds(kLongestInterpolation_s);
  constexpr Time kAnyGap = std::numeric_limits<Time>::max();
  PosePairs pairs;
  if (truth.empty()) return pairs;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Time near = truth[nearest(truth, estimate[i].time)].time;
    const bool is_near = std::abs(near - estimate[i].time) <= kNear;
    if (const auto pose = interpolate(truth, estimate[i].time, is_near ? kAnyGap : kLongestGap)) {
      pairs.push_back({estimate[i].time, estimate[i].pose, *pose, i});
    }
  }
  return pairs;
}

Trajectory truth_at(const std::vector<Time>& times, const Trajectory& truth) {
  Trajectory wanted;
  for (const Time time : times) wanted.push_back({time, {}});
  Trajectory found;
  for (const PosePair& pair : associate_interpolated(wanted, truth)) found.push_back({pair.time, pair.truth});
  return found;
}

}  // namespace lodestone
