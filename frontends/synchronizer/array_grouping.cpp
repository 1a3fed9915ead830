#include "frontends/synchronizer/array_grouping.h"

#include <algorithm>
#include <limits>

namespace lodestone {

bool ArrayGrouping::add(const MagneticSample& sample) {
  const auto index = static_cast<std::size_t>(sample.magnetometer);
  if (sample.magnetometer < 0 || index >= queues_.size()) return false;
  auto& queue = queues_[index];
  if (!queue.empty() && sample.time <= queue.back().time) return false;
  queue.push_back(sample);
  return true;
}

/// The shortest of the first intervals of the queued readings, since lost readings only lengthen intervals.
Time ArrayGrouping::half_period() const {
  Time shortest = std::numeric_limits<Time>::max();
  for (const auto& queue : queues_) {
    if (queue.size() >= 2) shortest = std::min(shortest, queue[1].time - queue[0].time);
  }
  if (shortest != std::numeric_limits<Time>::max()) last_half_period_ = shortest / 2;
  return last_half_period_;
}

bool ArrayGrouping::passed(Time time) const {
  const Time margin = half_period();
  return std::all_of(queues_.begin(), queues_.end(),
                     [&](const auto& queue) { return !queue.empty() && queue.back().time > time + margin; });
}

std::optional<MagneticArraySample> ArrayGrouping::take(Time end) {
  Time earliest = std::numeric_limits<Time>::max();
  for (const auto& queue : queues_) {
    if (!queue.empty()) earliest = std::min(earliest, queue.front().time);
  }
  if (earliest > end) return std::nullopt;
  const Time margin = half_period();
  Time later_sum = 0;
  int members = 0;
  for (const auto& queue : queues_) {
    if (queue.empty() || queue.front().time - earliest > margin) continue;
    later_sum += queue.front().time - earliest;
    ++members;
  }
  MagneticArraySample sample;
  sample.time = earliest + later_sum / members;
  if (sample.time > end) return std::nullopt;
  sample.field_ut.resize(queues_.size());
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    auto& queue = queues_[i];
    if (queue.empty() || queue.front().time - earliest > margin) continue;
    sample.field_ut[i] = queue.front().field_ut;
    queue.pop_front();
  }
  return sample;
}

int ArrayGrouping::forget(Time time) {
  int count = 0;
  for (auto& queue : queues_) {
    for (; !queue.empty() && queue.front().time <= time; ++count) queue.pop_front();
  }
  return count;
}

}  // namespace lodestone
