#include "tools/writers/lost_intervals.h"

#include <gtest/gtest.h>

#include <string_view>

namespace lodestone {
namespace {

/// One letter for each scan: g(ood), u(ncertain), l(ost). The time of a scan is its number, from 1.
std::vector<LostInterval> intervals_of(std::string_view healths) {
  LostIntervals intervals;
  Estimate estimate;
  for (const char letter : healths) {
    ++estimate.time;
    estimate.health = letter == 'g' ? Health::good : letter == 'u' ? Health::uncertain : Health::lost;
    EXPECT_EQ(intervals.add(estimate), letter != 'l');
  }
  return intervals.all();
}

void expect_interval(const LostInterval& interval, Time from, Time to, bool regained) {
  EXPECT_EQ(interval.from, from);
  EXPECT_EQ(interval.to, to);
  EXPECT_EQ(interval.regained, regained);
}

TEST(LostIntervals, AreNoneWithoutALoss) {
  EXPECT_TRUE(intervals_of("").empty());
  EXPECT_TRUE(intervals_of("gug").empty());
}

TEST(LostIntervals, ReachFromTheFirstToTheLastLostScan) {
  const std::vector<LostInterval> found = intervals_of("gglllgulu");
  ASSERT_EQ(found.size(), 2U);
  expect_interval(found[0], 3, 5, true);
  expect_interval(found[1], 8, 8, true);
}

TEST(LostIntervals, MayBeAtTheBeginningAndAtTheEnd) {
  const std::vector<LostInterval> found = intervals_of("llgll");
  ASSERT_EQ(found.size(), 2U);
  expect_interval(found[0], 1, 2, true);
  expect_interval(found[1], 4, 5, false);
  const std::vector<LostInterval> all = intervals_of("lll");
  ASSERT_EQ(all.size(), 1U);
  expect_interval(all[0], 1, 3, false);
}

}  // namespace
}  // namespace lodestone
