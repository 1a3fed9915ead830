#include "core/work_times.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace lodestone {
namespace {

double of(const WorkTimes& times, Work work) {
  return times[static_cast<std::size_t>(work)];
}

void work() {
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

TEST(WorkTimes, TimersWithinAreNotCountedTwice) {
  const WorkTimes before = work_times();
  const auto begin = std::chrono::steady_clock::now();
  {
    const WorkTimer outer(Work::estimate);
    work();
    {
      const WorkTimer inner(Work::solve);
      work();
    }
    work();
  }
  const double all = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  work();  // not counted
  const double solve = of(work_times(), Work::solve) - of(before, Work::solve);
  const double estimate = of(work_times(), Work::estimate) - of(before, Work::estimate);
  EXPECT_GE(solve, 0.020);
  EXPECT_GE(estimate, 0.040);
  EXPECT_LE(solve + estimate, all);
}

TEST(WorkTimes, ThreadsHaveTheirOwn) {
  const WorkTimes before = work_times();
  WorkTimes other{};
  std::thread([&] {
    const WorkTimer timer(Work::read);
    work();
    other = work_times();
  }).join();
  EXPECT_EQ(work_times(), before);
  EXPECT_EQ(of(other, Work::read), 0.0);  // counted when the timer ends
}

}  // namespace
}  // namespace lodestone
