#include "core/work_times.h"

#include <chrono>

namespace lodestone {

namespace {

using Clock = std::chrono::steady_clock;

thread_local WorkTimes times{};
thread_local WorkTimer* innermost = nullptr;
thread_local Clock::time_point last_change;

/// Seconds since the last call in this thread.
double elapsed_s() {
  const Clock::time_point now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - last_change).count();
  last_change = now;
  return seconds;
}

}  // namespace

WorkTimer::WorkTimer(Work work) : outer_(innermost), work_(static_cast<std::size_t>(work)) {
  const double seconds = elapsed_s();
  if (outer_ != nullptr) times[outer_->work_] += seconds;
  innermost = this;
}

WorkTimer::~WorkTimer() {
  times[work_] += elapsed_s();
  innermost = outer_;
}

const WorkTimes& work_times() {
  return times;
}

}  // namespace lodestone
