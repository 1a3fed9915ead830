#include "core/time.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lodestone {
namespace {

TEST(Time, SecondsAreRoundedToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(1.5), 1'500'000'000);
  EXPECT_EQ(from_seconds(0.6e-9), 1);
  EXPECT_EQ(from_seconds(-0.6e-9), -1);
  EXPECT_EQ(from_seconds(0.4e-9), 0);
  EXPECT_EQ(to_seconds(from_seconds(-12.25)), -12.25);
}

TEST(Time, NothingIsFurtherThanTheFarthest) {
  EXPECT_EQ(from_seconds(1e300), farthest_time);
  EXPECT_EQ(from_seconds(INFINITY), farthest_time);
  EXPECT_EQ(from_seconds(NAN), farthest_time);
  EXPECT_EQ(from_seconds(-1e300), -farthest_time);
  EXPECT_EQ(from_seconds(-4e9), -farthest_time);
  EXPECT_GT(farthest_time + farthest_time, farthest_time);
}

}  // namespace
}  // namespace lodestone
