#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/messages/cloud_layout.h"

/// Selection of the fields of coordinates and times by their names.
namespace lodestone {
namespace {

using ::lodestone::testing::CloudLayout;
using ::lodestone::testing::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Field = ros1::PointField;

/// A scan during which a new second begins, which affects times in two fields.
LidarScan turn_about_a_second() {
  LidarScan scan;
  scan.start = 1'700'000'000'950'000'123;
  for (int i = 0; i < 2000; ++i) {
    const double angle = i * M_PI / 1000.0;
    LidarPoint point;
    point.position = {static_cast<float>(5.0 * std::cos(angle)), static_cast<float>(5.0 * std::sin(angle)), 0.5F};
    point.ring = static_cast<std::uint16_t>(i % 4);
    point.offset_ns = 49'999 * i;
    scan.points.push_back(point);
  }
  scan.end = scan.start + scan.points.back().offset_ns;
  return scan;
}

Platform platform_that_names(const std::string& time_field) {
  Platform platform;
  platform.file = "robot.yaml";
  platform.lidar.topic = "/points";
  platform.lidar.intensity_field.clear();
  platform.lidar.ring_field.clear();
  platform.lidar.time_field = time_field;
  platform.lidar.time_unit.reset();
  platform.lidar.stamp.reset();
  return platform;
}

/// A message that can be modified, with its bytes.
struct AlterableCloud {
  ros1::PointCloudMessage message;
  std::vector<std::uint8_t> data;

  explicit AlterableCloud(const LidarScan& scan, const CloudLayout& layout = {}) { message = layout.write(scan, data); }

  template <class Value>
  void put(std::size_t point, std::size_t offset, Value value) {
    std::memcpy(data.data() + point * CloudLayout::point_step + offset, &value, sizeof(value));
  }
};

double worst_ns(const LidarScan& read, const LidarScan& written) {
  EXPECT_EQ(read.points.size(), written.points.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < std::min(read.points.size(), written.points.size()); ++i) {
    const Time apart = read.start + read.points[i].offset_ns - written.start - written.points[i].offset_ns;
    worst = std::max(worst, std::abs(static_cast<double>(apart)));
  }
  return worst;
}

std::string line_refusing(const AlterableCloud& cloud, const Platform& platform) {
  return message_of<InputError>([&] {
    WarningLog warnings;
    LidarScan read;
    PointCloudDecoder("log.bag", platform, warnings).decode(cloud.message, read);
  });
}

TEST(PointLayouts, TimesInSecondsAndNanosecondsAreReadToTheNanosecond) {
  const std::pair<const char*, const char*> names[] = {{"timeSecond", "timeNanosecond"},
                                                       {"time_sec", "time_nsec"},
                                                       {"sec", "nsec"},
                                                       {"lidar_sec", "lidar_nsec"},
                                                       {"secs", "nsecs"},
                                                       {"seconds", "nanos"},
                                                       {"sec", "nanosec"},
                                                       {"t_s", "t_ns"},
                                                       {"time_s", "time_ns"},
                                                       {"SecondsOfGps", "NanosecondsOfGps"},
                                                       {"stamp_sec", "stamp_nanosec"}};
  const LidarScan scan = turn_about_a_second();
  for (const auto& [seconds, nanoseconds] : names) {
    for (const Time origin : {Time{0}, scan.start - 77'960'000'000}) {  // absolute, and by the LiDAR's own clock
      for (const std::string& named_field : {std::string(), std::string(seconds), std::string(nanoseconds)}) {
        for (const bool nanoseconds_first : {false, true}) {
          SCOPED_TRACE(std::string(seconds) + " + " + nanoseconds + ", platform: " + named_field);
          AlterableCloud cloud(scan);
          const std::uint32_t at = nanoseconds_first ? 28 : 24, then = nanoseconds_first ? 24 : 28;
          cloud.message.fields.back() = {seconds, at, Field::uint32, 1};
          cloud.message.fields.push_back({nanoseconds, then, nanoseconds_first ? Field::int32 : Field::uint32, 1});
          if (nanoseconds_first) std::swap(cloud.message.fields[5], cloud.message.fields[6]);
          for (std::size_t i = 0; i < scan.points.size(); ++i) {
            const Time time = scan.start + scan.points[i].offset_ns - origin;
            cloud.put(i, at, static_cast<std::uint32_t>(time / 1'000'000'000));
            cloud.put(i, then, static_cast<std::uint32_t>(time % 1'000'000'000));
          }
          WarningLog warnings;
          LidarScan read;
          const Platform platform = platform_that_names(named_field);
          PointCloudDecoder("log.bag", platform, warnings).decode(cloud.message, read);
          EXPECT_LT(worst_ns(read, scan), 1.0);
          EXPECT_THAT(warnings.entries().at("lidar.told_from_content").first_detail,
                      HasSubstr(std::string(seconds) + " + " + nanoseconds));
        }
      }
    }
  }
}

TEST(PointLayouts, SecondsAndMicrosecondsAreNoPairAndNeitherAreOtherStems) {
  const std::pair<const char*, const char*> names[] = {
      {"sec", "usec"}, {"sec", "time_nsec"}, {"second_return", "nsec"}};
  for (const auto& [seconds, fraction] : names) {
    AlterableCloud cloud(turn_about_a_second());
    cloud.message.fields.back() = {seconds, 24, Field::uint32, 1};
    cloud.message.fields.push_back({fraction, 28, Field::uint32, 1});
    EXPECT_THAT(line_refusing(cloud, platform_that_names("")), HasSubstr("no field has the name of a time"))
        << fraction;
  }
}

TEST(PointLayouts, AWrongUnitOfTimesInTwoFieldsIsMended) {
  const LidarScan scan = turn_about_a_second();
  AlterableCloud cloud(scan);
  cloud.message.fields.back() = {"sec", 24, Field::uint32, 1};
  cloud.message.fields.push_back({"nsec", 28, Field::uint32, 1});
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    cloud.put(i, 24, static_cast<std::uint32_t>((scan.start + scan.points[i].offset_ns) / 1'000'000'000));
    cloud.put(i, 28, static_cast<std::uint32_t>((scan.start + scan.points[i].offset_ns) % 1'000'000'000));
  }
  Platform platform = platform_that_names("nsec");
  platform.lidar.time_unit = PointTimeUnit::microseconds;
  EXPECT_THAT(line_refusing(cloud, platform), HasSubstr("set lidar.time_unit: ns in robot.yaml"));
}

TEST(PointLayouts, EveryNameOfATimeIsReadInItsUnit) {
  constexpr auto s = PointTimeUnit::seconds, ms = PointTimeUnit::milliseconds, us = PointTimeUnit::microseconds;
  constexpr auto since_start = PointTimeZero::scan_start, absolute = PointTimeZero::epoch;
  const CloudLayout layouts[] = {
      {"time_ms", Field::float64, ms, since_start},   {"time_offset_us", Field::uint32, us, since_start},
      {"timestamp_us", Field::uint64, us, absolute},  {"utime", Field::uint64, us, absolute},
      {"gps_time", Field::float64, s, absolute},      {"GpsTime", Field::float64, s, absolute},
      {"curvature", Field::float32, ms, since_start}, {"curvature", Field::float64, ms, since_start}};
  const LidarScan scan = turn_about_a_second();
  for (const CloudLayout& layout : layouts) {
    const AlterableCloud cloud(scan, layout);
    WarningLog warnings;
    LidarScan read;
    const Platform platform = platform_that_names("");
    PointCloudDecoder("log.bag", platform, warnings).decode(cloud.message, read);
    const Time largest = layout.zero == absolute ? scan.end : scan.end - scan.start;
    // Factor two: the scan's start and the point's time are both rounded.
    EXPECT_LE(worst_ns(read, scan), 2.0 * layout.quantum_ns(largest) + 2.0) << layout.field;
    EXPECT_EQ(warnings.count("lidar.told_from_content"), 1);
  }
}

/// PCL's PointXYZINormal has the curvature of a surface, mostly zero.
TEST(PointLayouts, TheCurvatureOfASurfaceIsNoTime) {
  const LidarScan scan = turn_about_a_second();
  // A surface's curvature is at most a third; in seconds this would be a scan of 0.3 s.
  for (const float largest : {0.0F, 0.1F, 0.33F, 1.0F}) {
    AlterableCloud cloud(scan);  // "t" at 24
    cloud.message.fields.push_back({"curvature", 28, Field::float32, 1});
    for (std::size_t i = 0; i < scan.points.size(); ++i) cloud.put(i, 28, largest * static_cast<float>(i % 97) / 96.0F);
    WarningLog warnings;
    LidarScan read;
    const Platform platform = platform_that_names("");
    PointCloudDecoder("log.bag", platform, warnings).decode(cloud.message, read);
    EXPECT_EQ(worst_ns(read, scan), 0.0) << largest;
    // It is not used either if there are no other times.
    cloud.message.fields.erase(cloud.message.fields.begin() + 5);
    EXPECT_THAT(line_refusing(cloud, platform_that_names("")),
                AllOf(HasSubstr("no point field is readable as each point's time: 'curvature'"),
                      HasSubstr("record the driver's full points")))
        << largest;
    Platform with_unit = platform_that_names("");
    with_unit.lidar.time_unit = PointTimeUnit::seconds;
    EXPECT_THAT(line_refusing(cloud, with_unit), HasSubstr("no point field is readable as each point's time"))
        << largest;
  }
}

TEST(PointLayouts, ATimeByAnyNameComesBeforeACurvature) {
  const LidarScan scan = turn_about_a_second();
  AlterableCloud cloud(scan, {"gps_time", Field::float64, PointTimeUnit::seconds, PointTimeZero::epoch});
  cloud.message.fields.insert(cloud.message.fields.begin(), {"curvature", 20, Field::float32, 1});
  for (std::size_t i = 0; i < scan.points.size(); ++i) cloud.put(i, 20, 100.0F - 0.05F * static_cast<float>(i));
  WarningLog warnings;
  LidarScan read;
  const Platform platform = platform_that_names("");
  PointCloudDecoder("log.bag", platform, warnings).decode(cloud.message, read);
  EXPECT_LT(worst_ns(read, scan), 300.0);
}

TEST(PointLayouts, CoordinatesMayBeCapitalLettersAndSmallOnesComeFirst) {
  const LidarScan scan = turn_about_a_second();
  AlterableCloud cloud(scan);
  for (const int i : {0, 1, 2}) cloud.message.fields[i].name = std::string(1, static_cast<char>('X' + i));
  WarningLog warnings;
  LidarScan read;
  const Platform platform = platform_that_names("");
  PointCloudDecoder("log.bag", platform, warnings).decode(cloud.message, read);
  ASSERT_EQ(read.points.size(), scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) EXPECT_EQ(read.points[i].position, scan.points[i].position);
  // If x and X exist, X is another quantity.
  AlterableCloud both(scan);
  both.message.fields.insert(both.message.fields.begin(), {"X", 12, Field::float32, 1});
  PointCloudDecoder("log.bag", platform, warnings).decode(both.message, read);
  EXPECT_EQ(read.points[9].position, scan.points[9].position);
}

TEST(PointLayouts, ACloudWithoutCoordinatesIsToldWhatIsExpected) {
  AlterableCloud cloud(turn_about_a_second());
  cloud.message.fields[1].name = "azimuth";
  const std::string line = line_refusing(cloud, platform_that_names(""));
  EXPECT_THAT(line, AllOf(HasSubstr("there is no point field 'y'; the message has x, azimuth, z, intensity, ring, t;"),
                          HasSubstr("the fields x, y and z"), Not(HasSubstr("lidar.fields"))));
}

}  // namespace
}  // namespace lodestone
