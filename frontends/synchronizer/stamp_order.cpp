#include "frontends/synchronizer/stamp_order.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr double largest_jump_s = 10.0;

/// If a clock keeps jumping, only the last lags are kept.
constexpr std::size_t most_lags = 16;

}  // namespace

StampOrder::StampOrder(std::vector<Time> first_lags) {
  std::sort(first_lags.begin(), first_lags.end());
  const std::size_t worth = std::max<std::size_t>(2, first_lags.size() / 10);
  std::size_t most = 0;
  for (std::size_t begin = 0, end = 0; begin < first_lags.size(); begin = end) {
    while (end < first_lags.size() && to_seconds(first_lags[end]) - to_seconds(first_lags[begin]) <= largest_jump_s)
      ++end;
    const std::size_t count = end - begin;
    const Time median = first_lags[begin + count / 2];
    if (count > most) {
      if (most > 0 && most < worth) lags_.clear();
      lags_.insert(lags_.begin(), median);  // the usual lag is the first
      most = count;
    } else if (count >= worth && lags_.size() < most_lags) {
      lags_.push_back(median);
    }
  }
}

StampOrder::Verdict StampOrder::judge(Time record_time, Time stamp) {
  if (lags_.empty()) lags_.push_back(record_time - stamp);
  // In seconds, since sums of extreme values of Time would overflow.
  const auto off_s = [&](Time lag) { return to_seconds(stamp) - (to_seconds(record_time) - to_seconds(lag)); };
  for (const Time lag : lags_) {
    if (std::abs(off_s(lag)) <= largest_jump_s) return {};
  }
  if (any_) {
    const double stamped_s = to_seconds(stamp) - to_seconds(last_stamp_);
    const double leap_s = to_seconds(record_time) - to_seconds(last_record_time_) - stamped_s;
    if (std::abs(stamped_s) <= largest_jump_s && std::abs(leap_s) > largest_jump_s) {
      if (lags_.size() >= most_lags) lags_.erase(lags_.begin() + 1);
      lags_.push_back(record_time - stamp);
      return {Verdict::recorder_leapt, leap_s};
    }
  }
  return {Verdict::broken, off_s(lags_.front())};
}

void StampOrder::take(Time record_time, Time stamp) {
  last_stamp_ = stamp;
  last_record_time_ = record_time;
  any_ = true;
}

}  // namespace lodestone
