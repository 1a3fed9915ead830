#include "tools/check/turn_integral.h"

#include <algorithm>

namespace lodestone {
namespace {

constexpr Time longest_step = 50'000'000;

}  // namespace

TurnIntegral::TurnIntegral(const std::vector<ImuSample>& imu) {
  Vector3 sum = Vector3::Zero();
  int gaps = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    if (i > 0) {
      const Time step = imu[i].time - imu[i - 1].time;
      sum += 0.5 * to_seconds(step) * (imu[i].angular_velocity + imu[i - 1].angular_velocity);
      if (step > longest_step) ++gaps;
    }
    times_.push_back(imu[i].time);
    sums_.push_back(sum);
    gaps_.push_back(gaps);
  }
}

std::optional<TurnIntegral::Place> TurnIntegral::place_of(Time time) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), time);
  if (after == times_.begin() || after == times_.end()) return std::nullopt;
  const auto index = static_cast<std::size_t>(after - times_.begin()) - 1;
  return Place{index, to_seconds(time - times_[index]) / to_seconds(times_[index + 1] - times_[index])};
}

std::optional<Vector3> TurnIntegral::over(Time begin, Time end) const {
  const auto from = place_of(begin);
  const auto to = place_of(end);
  if (!from || !to || gaps_[from->index] != gaps_[to->index + 1]) return std::nullopt;
  const auto at = [&](const Place& place) {
    return (sums_[place.index] + place.share * (sums_[place.index + 1] - sums_[place.index])).eval();
  };
  return at(*to) - at(*from);
}

}  // namespace lodestone
