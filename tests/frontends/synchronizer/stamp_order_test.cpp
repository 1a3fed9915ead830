#include "frontends/synchronizer/stamp_order.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lodestone {
namespace {

TEST(StampOrder, WhatARecorderThatStoodStillWritesLateIsTakenAndWhatFollowsToo) {
  StampOrder order;
  for (int i = 0; i < 4000; ++i) {
    const Time stamp = Time{i} * 5'000'000;
    // No records from 5 s to 17 s, then everything at once.
    const Time recorded = stamp < 5'000'000'000 ? stamp : std::max(stamp, Time{17'000'000'000});
    ASSERT_NE(order.judge(recorded, stamp).what, StampOrder::Verdict::broken) << i;
    order.take(recorded, stamp);
  }
}

TEST(StampOrder, OneOddLagAmongTheFirstIsNoGoodOne) {
  const Time odd = 60'000'000'000;
  for (const std::vector<Time>& lags : {std::vector<Time>{odd, 0, 0}, {0, odd, 1}, {-odd, 0, 5, odd, 7}}) {
    StampOrder order(lags);
    EXPECT_LE(order.usual_lag(), 7);
    EXPECT_EQ(order.judge(odd, 0).what, StampOrder::Verdict::broken);
    EXPECT_EQ(order.judge(odd, odd).what, StampOrder::Verdict::sound);
  }
  StampOrder set(std::vector<Time>{0, 0, 0, odd, odd});
  EXPECT_EQ(set.judge(odd, 0).what, StampOrder::Verdict::sound) << "the recorder's clock was set meanwhile";
}

TEST(StampOrder, AClockThatCreepsAwayIsNotFollowed) {
  StampOrder order;
  int taken = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Time recorded = Time{i} * 5'000'000, stamp = 2 * recorded;
    if (order.judge(recorded, stamp).what == StampOrder::Verdict::broken) continue;
    order.take(recorded, stamp);
    ++taken;
  }
  EXPECT_EQ(taken, 2001) << "10 s at twice the speed";
}

}  // namespace
}  // namespace lodestone
