#include "frontends/logs/isolated_times.h"

namespace lodestone {
namespace {

constexpr Time one_second = 1'000'000'000;
constexpr Time largest_neighbour_gap = 10 * one_second;
constexpr Time isolated_by = 60 * one_second;
constexpr Time isolated_at_an_end_by = 24 * 3600 * one_second;

bool is_isolated(Time time, Time neighbour, Time other, Time by) {
  const auto gap = [](Time a, Time b) {
    return a < b ? b - a : a - b;
  };  // times are at most farthest_time: no overflow
  return gap(neighbour, other) <= largest_neighbour_gap && gap(time, neighbour) > by && gap(time, other) > by;
}

}  // namespace

std::vector<std::size_t> isolated_times(std::span<const Time> times) {
  std::vector<std::size_t> isolated;
  const std::size_t count = times.size();
  if (count < 3) return isolated;
  if (is_isolated(times[0], times[1], times[2], isolated_at_an_end_by)) isolated.push_back(0);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    if (is_isolated(times[i], times[i - 1], times[i + 1], isolated_by)) isolated.push_back(i);
  }
  if (is_isolated(times[count - 1], times[count - 2], times[count - 3], isolated_at_an_end_by)) {
    isolated.push_back(count - 1);
  }
  return isolated;
}

}  // namespace lodestone
