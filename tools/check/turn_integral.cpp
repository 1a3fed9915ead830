#include "tools/check/turn_integral.h"

#include <limits>

#include "tools/check/vector_series.h"

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

std::optional<Vector3> TurnIntegral::over(Time begin, Time end) const {
  constexpr Time kAnyGap = std::numeric_limits<Time>::max();
  const auto from = place_in(times_, begin, kAnyGap);
  const auto to = place_in(times_, end, kAnyGap);
  if (!from || !to || gaps_[from->index] != gaps_[to->index + 1]) return std::nullopt;
  return to->value_of(sums_) - from->value_of(sums_);
}

}  // namespace lodestone
