// Clock offsets stated in the platform file, applied by BagSource.
#include <gtest/gtest.h>

#include "tests/frontends/logs/log_contents.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

testing::Contents measurements_of(const testing::SyntheticLog& log, const Platform& platform) {
  const testing::TemporaryFolder folder;
  log.write(folder / "log.bag");
  return testing::read_all(folder / "log.bag", platform);
}

/// An offset is a stamp minus the IMU's time: late stamps have a positive offset.
TEST(ClockOffset, IsSubtractedFromStamps) {
  const testing::SyntheticLog log;
  Platform platform = log.platform();
  const testing::Contents before = measurements_of(log, platform);
  platform.lidar.clock_offset_s = 0.012;
  platform.magnetometer_clock_offset_s = -0.007;
  const testing::Contents after = measurements_of(log, platform);
  ASSERT_EQ(after.scans.size(), before.scans.size());
  ASSERT_EQ(after.fields.size(), before.fields.size());
  ASSERT_EQ(after.imu.size(), before.imu.size());
  for (std::size_t i = 0; i < after.scans.size(); ++i) {
    EXPECT_EQ(after.scans[i].start, before.scans[i].start - 12'000'000);
    EXPECT_EQ(after.scans[i].end, before.scans[i].end - 12'000'000);
  }
  for (std::size_t i = 0; i < after.fields.size(); ++i) {
    EXPECT_EQ(after.fields[i].time, before.fields[i].time + 7'000'000);
  }
  for (std::size_t i = 0; i < after.imu.size(); ++i) EXPECT_EQ(after.imu[i].time, before.imu[i].time);
  EXPECT_TRUE(after.warnings.entries().empty());
}

/// A log with a late LiDAR clock is read like that of a robot with one clock.
TEST(ClockOffset, UndoesALateClock) {
  testing::SyntheticLog log;
  Platform platform = log.platform();
  const testing::Contents exact = measurements_of(log, platform);
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, std::vector<std::uint8_t>&) {
    cloud.stamp += 30'000'000;
    return true;
  };
  platform.lidar.clock_offset_s = 0.030;
  const testing::Contents corrected = measurements_of(log, platform);
  ASSERT_EQ(corrected.scans.size(), exact.scans.size());
  for (std::size_t i = 0; i < exact.scans.size(); ++i) {
    EXPECT_EQ(corrected.scans[i].start, exact.scans[i].start);
    EXPECT_EQ(corrected.scans[i].end, exact.scans[i].end);
  }
}

}  // namespace
}  // namespace lodestone
