#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "frontends/logs/log_conversion.h"
#include "frontends/logs/open_log.h"
#include "frontends/messages/wheel_positions.h"
#include "tests/frontends/logs/log_contents.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::Contents;
using ::lodestone::testing::message_of;
using ::lodestone::testing::read_all;
using ::lodestone::testing::SyntheticLog;
using ::lodestone::testing::TemporaryFolder;
using ::testing::HasSubstr;

SyntheticLog wheeled_log() {
  SyntheticLog log;
  log.scans = 5;
  log.on_wheels = [](int, ros1::OdometryMessage&) { return true; };
  return log;
}

Platform wheeled_platform(const SyntheticLog& log) {
  Platform platform = log.platform();
  platform.suite.wheels.emplace();
  return platform;
}

TEST(WheelOdometry, IsReadInWheelAxesWithScaleAndClockOffset) {
  const TemporaryFolder folder;
  const SyntheticLog log = wheeled_log();
  log.write(folder / "log.bag");
  Platform platform = wheeled_platform(log);
  platform.wheels.scale = 2.0;
  platform.wheels.clock_offset_s = 0.001;
  const Contents contents = read_all(folder / "log.bag", platform);
  ASSERT_GE(contents.wheels.size(), 25U);
  EXPECT_EQ(contents.wheels[4].time, log.start + 4 * SyntheticLog::wheel_period + 2'000'000);
  EXPECT_DOUBLE_EQ(contents.wheels[4].forward_velocity_m_s, 0.02);
  EXPECT_DOUBLE_EQ(contents.wheels[4].lateral_velocity_m_s, 0.01);
  EXPECT_DOUBLE_EQ(contents.wheels[4].yaw_rate_rad_s, 0.3);
  const Contents without = read_all(folder / "log.bag", log.platform());
  EXPECT_TRUE(without.wheels.empty());
  EXPECT_EQ(without.imu.size(), contents.imu.size());
}

TEST(WheelOdometry, IsTheSameAfterConversionToBothFormatsOfRos2) {
  const TemporaryFolder folder;
  const SyntheticLog log = wheeled_log();
  log.write(folder / "log.bag");
  const Platform platform = wheeled_platform(log);
  const Contents before = read_all(folder / "log.bag", platform);
  const struct {
    const char *from, *to;
    LogFormat format;
  } steps[] = {{"log.bag", "log.mcap", LogFormat::mcap},
               {"log.bag", "log.db3", LogFormat::db3},
               {"log.mcap", "back.bag", LogFormat::rosbag}};
  for (const auto& [from, name, format] : steps) {
    WarningLog warnings;
    const auto source = open_log(folder / from, warnings);
    const auto writer = make_log_writer(folder / name, format, Codec::none);
    convert_log("log", *source, *writer, [](Time) {});
    writer->close();
    const Contents after = read_all(folder / name, platform);
    ASSERT_EQ(after.wheels.size(), before.wheels.size()) << name;
    for (std::size_t i = 0; i < before.wheels.size(); ++i) {
      EXPECT_EQ(after.wheels[i].time, before.wheels[i].time);
      EXPECT_EQ(after.wheels[i].forward_velocity_m_s, before.wheels[i].forward_velocity_m_s);
      EXPECT_EQ(after.wheels[i].yaw_rate_rad_s, before.wheels[i].yaw_rate_rad_s);
    }
  }
}

TEST(WheelOdometry, CanComeFromFieldsOfOtherMessages) {
  const TemporaryFolder folder;
  const SyntheticLog log = wheeled_log();
  log.write(folder / "log.bag");
  Platform platform = wheeled_platform(log);
  platform.wheels.linear_velocity_path = "twist.twist.linear";
  platform.wheels.angular_velocity_path = "twist.twist.angular";
  const Contents contents = read_all(folder / "log.bag", platform);
  ASSERT_GE(contents.wheels.size(), 25U);
  EXPECT_DOUBLE_EQ(contents.wheels[4].forward_velocity_m_s, 0.04);
  EXPECT_DOUBLE_EQ(contents.wheels[4].yaw_rate_rad_s, 0.3);
}

TEST(WheelOdometry, CanComeFromAWheelOnEachSide) {
  const TemporaryFolder folder;
  SyntheticLog log = wheeled_log();
  const double step_s = to_seconds(SyntheticLog::wheel_period);
  // Left 0.5 m/s, right 0.7 m/s and counted backwards, in half metres.
  log.on_wheels = [&](int i, ros1::OdometryMessage& odometry) {
    odometry.linear_velocity = {1.0, -1.4, 0.0};
    odometry.angular_velocity = {i * step_s * 1.0, -i * step_s * 1.4, 0.0};
    return i != 7;  // a lost message
  };
  log.write(folder / "log.bag");
  Platform platform = wheeled_platform(log);
  platform.wheels.scale = 2.0;
  platform.wheels.track_m = 0.4;
  for (const bool positions : {false, true}) {
    const std::string vector = positions ? "twist.twist.angular" : "twist.twist.linear";
    platform.wheels.positions = positions;
    platform.wheels.left_path = vector + ".x";
    platform.wheels.right_path = "-" + vector + ".y";
    const Contents contents = read_all(folder / "log.bag", platform);
    ASSERT_GE(contents.wheels.size(), 22U);
    for (const WheelSample& sample : contents.wheels) {
      EXPECT_NEAR(sample.forward_velocity_m_s, 0.6, 1e-9);
      EXPECT_NEAR(sample.yaw_rate_rad_s, 0.2 / 0.4, 1e-9);
    }
    // Positions give the mean velocity between two messages, at its middle.
    EXPECT_EQ(contents.wheels[0].time, log.start + 3'000'000 + (positions ? SyntheticLog::wheel_period / 2 : 0));
  }
  platform.wheels.left_path = "twist.twist.linear";
  EXPECT_THAT(message_of<InputError>([&] { read_all(folder / "log.bag", platform); }),
              HasSubstr("wheels.left_position: 'twist.twist.linear' is not a number of a nav_msgs/Odometry"));
}

TEST(WheelOdometry, CountersThatBeginAnewGoOn) {
  WheelPositions positions;
  constexpr double kPeriod = 65536.0;
  EXPECT_FALSE(positions.add(0, {65530.0, kPeriod}, {5.0, kPeriod}));
  const auto found = positions.add(from_seconds(0.1), {4.0, kPeriod}, {65531.0, kPeriod});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->left, 100.0, 1e-9);
  EXPECT_NEAR(found->right, -100.0, 1e-9);
  EXPECT_EQ(found->time, from_seconds(0.05));
  EXPECT_TRUE(positions.add(from_seconds(0.1), {4.0, kPeriod}, {65531.0, kPeriod})) << "the same message again";
  EXPECT_FALSE(positions.add(from_seconds(1.0), {14.0, kPeriod}, {65531.0, kPeriod})) << "after a pause";
  EXPECT_FALSE(positions.add(from_seconds(0.9), {24.0, kPeriod}, {65531.0, kPeriod})) << "back in time";
}

TEST(WheelOdometry, ThatIsBrokenIsDiscardedAndThatIsMissingIsAnError) {
  const TemporaryFolder folder;
  SyntheticLog log = wheeled_log();
  log.on_wheels = [](int i, ros1::OdometryMessage& odometry) {
    if (i == 3) odometry.linear_velocity[0] = std::numeric_limits<double>::quiet_NaN();
    if (i == 5) odometry.stamp -= 2 * SyntheticLog::wheel_period;
    return true;
  };
  log.write(folder / "log.bag");
  Platform platform = wheeled_platform(log);
  const Contents contents = read_all(folder / "log.bag", platform);
  EXPECT_EQ(contents.warnings.count("wheels.not_finite"), 1);
  EXPECT_EQ(contents.warnings.count("wheels.stamp_back"), 1);
  platform.wheels.topic = "/odometry";
  const std::string error = message_of<InputError>([&] { read_all(folder / "log.bag", platform); });
  EXPECT_THAT(error, HasSubstr("did you mean /odom?"));
  EXPECT_THAT(error, HasSubstr("wheels.topic in platform.yaml"));
  EXPECT_THAT(error, HasSubstr("remove the section wheels"));
}

}  // namespace
}  // namespace lodestone
