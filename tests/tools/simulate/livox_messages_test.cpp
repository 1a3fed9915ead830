#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/test_files.h"
#include "tools/simulate/bag_recorder.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* long_hall = R"(
name: hall
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {pattern: rosette, min_range_m: 0.1, max_range_m: 40}
solids:
  - {name: hall, shape: box, at_m: [0, 0, 1.5], size_m: [90, 12, 3]}
sequences:
  short: {waypoints_m: [[-4, 0], [4, 0]], speed: [[0, 1.0]]}
)";

class LivoxMessages : public ::testing::Test {
 protected:
  void SetUp() override { write_text_file(folder_ / "hall.yaml", long_hall); }

  /// Two seconds of log from `start_s` on, recorded in `format`; returns the simulated scans.
  std::vector<LidarScan> record(ScanFormat format, double start_s) const {
    const World world = load_world(folder_ / "hall.yaml", {"start_time_s=" + std::to_string(start_s)});
    SimulationSource source(world, std::make_shared<Environment>(world), "short", SimulationSource::Drive::sequence, 1,
                            2.0);
    const Platform platform = platform_for(format);
    BagRecorder recorder(folder_ / "log.bag", {platform.lidar.topic, platform.imu.topic, {}}, format);
    std::vector<LidarScan> scans;
    for (Measurement measurement; source.next(measurement);) {
      recorder.write(measurement);
      if (auto* scan = std::get_if<LidarScan>(&measurement)) scans.push_back(std::move(*scan));
    }
    recorder.close();
    return scans;
  }

  static Platform platform_for(ScanFormat format) {
    Platform platform;
    platform.lidar = message_layout(format);
    return platform;
  }

  std::vector<LidarScan> read(const Platform& platform) const {
    WarningLog warnings;
    BagSource source(folder_ / "log.bag", platform, warnings, {.magnetometers = false});
    std::vector<LidarScan> scans;
    for (Measurement measurement; source.next(measurement);)
      if (auto* scan = std::get_if<LidarScan>(&measurement)) scans.push_back(std::move(*scan));
    EXPECT_TRUE(warnings.entries().empty());
    return scans;
  }

  static void expect_same(const std::vector<LidarScan>& a, const std::vector<LidarScan>& b, Time tolerance) {
    ASSERT_GT(a.size(), 10U);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      ASSERT_GT(a[k].points.size(), 5000U);
      ASSERT_EQ(a[k].points.size(), b[k].points.size());
      for (std::size_t i = 0; i < a[k].points.size(); ++i) {
        const LidarPoint &x = a[k].points[i], &y = b[k].points[i];
        ASSERT_EQ(x.position, y.position);
        ASSERT_EQ(x.intensity, y.intensity);
        ASSERT_EQ(x.ring, y.ring);
        ASSERT_LE(std::abs(a[k].start + x.offset_ns - b[k].start - y.offset_ns), tolerance);
      }
    }
  }

  static void expect_same_bits(const std::vector<LidarScan>& a, const std::vector<LidarScan>& b) {
    expect_same(a, b, 0);
    for (std::size_t k = 0; k < a.size(); ++k) {
      ASSERT_EQ(a[k].start, b[k].start);
      ASSERT_EQ(a[k].end, b[k].end);
      for (std::size_t i = 0; i < a[k].points.size(); ++i)
        ASSERT_EQ(a[k].points[i].offset_ns, b[k].points[i].offset_ns);
    }
  }

  TemporaryFolder folder_;
};

// A double represents whole nanoseconds up to 104 days.
constexpr double within_100_days_s = 1.0e6;

TEST_F(LivoxMessages, BothGiveTheSameScansBitByBit) {
  const auto simulated = record(ScanFormat::livox_custom, within_100_days_s);
  const auto custom = read(platform_for(ScanFormat::livox_custom));
  expect_same(simulated, custom, 0);
  record(ScanFormat::livox, within_100_days_s);
  expect_same_bits(custom, read(platform_for(ScanFormat::livox)));
}

TEST_F(LivoxMessages, APointCloudOfTodayRoundsTimesTo256Nanoseconds) {
  const auto simulated = record(ScanFormat::livox_custom, 1.7e9);
  const auto custom = read(platform_for(ScanFormat::livox_custom));
  expect_same(simulated, custom, 0);
  record(ScanFormat::livox, 1.7e9);
  expect_same(simulated, read(platform_for(ScanFormat::livox)), 128);
}

TEST_F(LivoxMessages, OnePlatformFileServesBoth) {
  Platform platform = load_platform(std::string(LODESTONE_SOURCE_DIR) + "/config/platforms/scout_mid360.yaml");
  EXPECT_EQ(platform.lidar.time_field, "");
  record(ScanFormat::livox_custom, within_100_days_s);
  const auto custom = read(platform);
  record(ScanFormat::livox, within_100_days_s);
  expect_same_bits(custom, read(platform));
  // Keys that describe a PointCloud2 do not affect a CustomMsg.
  record(ScanFormat::livox_custom, within_100_days_s);
  expect_same_bits(custom, read(platform_for(ScanFormat::livox)));
}

TEST_F(LivoxMessages, AStampAtTheEndPlacesThePointsBeforeIt) {
  const auto simulated = record(ScanFormat::livox_custom, within_100_days_s);
  Platform platform = platform_for(ScanFormat::livox_custom);
  platform.lidar.stamp = ScanStamp::end;
  const auto read_back = read(platform);
  EXPECT_EQ(read_back[3].end, simulated[3].start);
}

TEST_F(LivoxMessages, AnotherLidarWithoutANamedTimeFieldTellsItself) {
  const auto simulated = record(ScanFormat::ouster, within_100_days_s);
  Platform platform = platform_for(ScanFormat::livox_custom);
  platform.lidar.topic = "/livox/lidar";
  platform.file = "robot.yaml";
  EXPECT_THAT(message_of<InputError>([&] { read(platform); }), AllOf(HasSubstr("robot.yaml"), HasSubstr("/ouster")));
  platform.lidar.topic = "/ouster/points";
  WarningLog warnings;
  BagSource source(folder_ / "log.bag", platform, warnings, {.magnetometers = false});
  std::vector<LidarScan> scans;
  for (Measurement measurement; source.next(measurement);)
    if (auto* scan = std::get_if<LidarScan>(&measurement)) scans.push_back(std::move(*scan));
  expect_same(simulated, scans, 0);
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 1);
}

/// A bag with one CustomMsg of 777 points, with `stated_count` as its stated count, and `bytes` bytes of points.
class MalformedCustomMsg : public LivoxMessages {
 protected:
  void write(std::uint32_t stated_count, std::size_t bytes) const {
    const std::vector<std::uint8_t> data(20'000);
    ros1::BagWriter writer(folder_ / "log.bag", Codec::none);
    for (int i = 0; i < 300; ++i) {
      ros1::ImuMessage imu;
      imu.stamp = 1'700'000'000'000'000'000 + i * 5'000'000;
      imu.linear_acceleration = {0, 0, 9.81};
      writer.write("/imu/data", imu.stamp, imu);
    }
    ros1::LivoxMessage message;
    message.stamp = 1'700'000'001'000'000'000;
    message.point_count = stated_count;
    message.data = data.data();
    message.data_size = bytes;
    writer.write("/livox/lidar", message.stamp, message);
    writer.close();
  }

  std::string error() const {
    return message_of<InputError>([&] { read(platform_for(ScanFormat::livox_custom)); });
  }
};

TEST_F(MalformedCustomMsg, IsNamedInOneLine) {
  const auto one_line = AllOf(HasSubstr("log.bag"), HasSubstr("/livox/lidar"), HasSubstr("1700000001 s"),
                              HasSubstr("19 bytes per point"), ::testing::Not(HasSubstr("\n")));
  write(778, 777 * 19);  // the stated count differs from the length of the list
  EXPECT_THAT(error(), one_line);
  write(777, 777 * 19 + 7);  // bytes after the last point
  EXPECT_THAT(error(), one_line);
  write(777, 777 * 19);
  std::string bytes = read_text_file(folder_ / "log.bag");
  const std::string count("\x09\x03\x00\x00\x00\x00\x00\x00\x09\x03\x00\x00", 12);  // 777, id and reserved, 777
  const std::size_t at = bytes.find(count);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 1] = bytes[at + 9] = '\x04';  // both counts are 1033: the message ends before
  std::ofstream(folder_ / "log.bag", std::ios::binary) << bytes;
  EXPECT_THAT(error(), one_line);
}

TEST_F(MalformedCustomMsg, TheSameMessageWholeIsRead) {
  write(777, 777 * 19);
  WarningLog warnings;
  BagSource source(folder_ / "log.bag", platform_for(ScanFormat::livox_custom), warnings, {.magnetometers = false});
  int scans = 0;
  for (Measurement measurement; source.next(measurement);) scans += std::holds_alternative<LidarScan>(measurement);
  EXPECT_EQ(scans, 1);  // all its points are at the origin, which means "no return"
}

}  // namespace
}  // namespace lodestone::simulation
