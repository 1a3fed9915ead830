// Clouds of drivers that deskew: one time for all points, or no times.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "core/error.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/messages/cloud_layout.h"

namespace lodestone {
namespace {

using ::lodestone::testing::CloudLayout;
using ::lodestone::testing::message_of;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr Time deskewed_stamp = 1'700'000'000'050'000'000;
constexpr const char* suggestion = ", or lidar.point_times: none if the scans are deskewed already";

/// Two thousand points with one time; the third point has no position.
LidarScan deskewed_scan() {
  LidarScan scan;
  scan.start = scan.end = deskewed_stamp;
  scan.points.resize(2000);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    scan.points[i].position = Eigen::Vector3f(5.0F, 0.01F * static_cast<float>(i), 1.0F);
    scan.points[i].ring = static_cast<std::uint16_t>(i % 32);
  }
  scan.points[2].position.x() = std::numeric_limits<float>::quiet_NaN();
  return scan;
}

struct DeskewedCloud : ::testing::Test {
  DeskewedCloud() {
    platform.file = "robot.yaml";
    platform.lidar.stamp.reset();
    platform.lidar.intensity_field.clear();
    platform.lidar.ring_field.clear();
    platform.lidar.time_field.clear();
    platform.lidar.time_unit.reset();
    with_times = CloudLayout{}.write(deskewed_scan(), data);
    without_times = with_times;
    without_times.fields.pop_back();
  }

  LidarScan read(const ros1::PointCloudMessage& message) {
    LidarScan scan;
    PointCloudDecoder("log.bag", platform, warnings).decode(message, scan);
    return scan;
  }

  std::string refusal(const ros1::PointCloudMessage& message) {
    return message_of<InputError>([&] { read(message); });
  }

  std::vector<std::uint8_t> data;
  ros1::PointCloudMessage with_times, without_times;
  Platform platform;
  WarningLog warnings;
};

TEST_F(DeskewedCloud, PointsBeyondEveryLidarAreDropped) {
  platform.lidar.point_times = PointTimes::none;
  LidarScan scan = deskewed_scan();
  scan.points[7].position = {1e20F, 0.0F, 0.0F};
  scan.points[8].position = {0.0F, 0.0F, -131'100.0F};
  scan.points[9].position = {0.0F, 131'000.0F, 0.0F};
  with_times = CloudLayout{}.write(scan, data);
  EXPECT_EQ(read(with_times).points.size(), 1997U);
  EXPECT_EQ(warnings.count("lidar.far_points"), 2);
  EXPECT_EQ(warnings.count("lidar.nan_points"), 1);
}

TEST_F(DeskewedCloud, IsTakenAsOfItsStamp) {
  platform.lidar.point_times = PointTimes::none;
  const std::optional<ScanStamp> stamps[] = {std::nullopt, ScanStamp::start, ScanStamp::middle, ScanStamp::end};
  for (const auto& stamp : stamps) {
    platform.lidar.stamp = stamp;
    for (const ros1::PointCloudMessage& message : {with_times, without_times}) {
      const LidarScan scan = read(message);
      EXPECT_EQ(scan.start, deskewed_stamp);
      EXPECT_EQ(scan.end, deskewed_stamp);
      ASSERT_EQ(scan.points.size(), 1999U) << "without the point that is not finite";
      for (const LidarPoint& point : scan.points) ASSERT_EQ(point.offset_ns, 0);
      EXPECT_EQ(scan.points[1998].ring, 1999 % 32) << "rings are found by name";
    }
  }
  EXPECT_EQ(warnings.entries().size(), 1U);
  EXPECT_EQ(warnings.count("lidar.nan_points"), 8);
}

TEST_F(DeskewedCloud, TimesThatAreThereAreNotRead) {
  platform.lidar.point_times = PointTimes::none;
  LidarScan spinning = deskewed_scan();
  for (std::size_t i = 0; i < spinning.points.size(); ++i)
    spinning.points[i].offset_ns = static_cast<std::int32_t>(50'000 * i);
  const LidarScan scan = read(CloudLayout{}.write(spinning, data));
  EXPECT_EQ(scan.start, deskewed_stamp);
  EXPECT_EQ(scan.end, deskewed_stamp);
  EXPECT_EQ(scan.points.back().offset_ns, 0);
}

TEST_F(DeskewedCloud, OneDecoderReadsScanAfterScan) {
  platform.lidar.point_times = PointTimes::none;
  PointCloudDecoder decoder("log.bag", platform, warnings);
  for (const Time later : {0, 100'000'000}) {
    for (ros1::PointCloudMessage message : {with_times, without_times}) {
      message.stamp += later;
      LidarScan scan;
      decoder.decode(message, scan);
      EXPECT_EQ(scan.start, deskewed_stamp + later);
      EXPECT_EQ(scan.points.size(), 1999U);
    }
  }
  // A scan without points also has its stamp as time.
  ros1::PointCloudMessage empty = without_times;
  empty.width = empty.height = 0;
  empty.data_size = 0;
  LidarScan scan;
  decoder.decode(empty, scan);
  EXPECT_TRUE(scan.points.empty());
  EXPECT_EQ(scan.start, deskewed_stamp);
  EXPECT_EQ(scan.end, deskewed_stamp);
}

TEST_F(DeskewedCloud, OfALivoxIsTakenAsOfItsStamp) {
  platform.lidar.point_times = PointTimes::none;
  ros1::LivoxMessage message;
  message.stamp = deskewed_stamp;
  message.point_count = 1500;
  std::vector<std::uint8_t> points(std::size_t{1500} * ros1::LivoxMessage::point_step);
  for (std::size_t i = 0; i < 1500; ++i) {
    const auto offset = static_cast<std::uint32_t>(40'000 * i);
    const float position[3] = {4.0F, 0.01F * static_cast<float>(i), 1.0F};
    std::memcpy(points.data() + i * ros1::LivoxMessage::point_step, &offset, 4);
    std::memcpy(points.data() + i * ros1::LivoxMessage::point_step + 4, position, 12);
  }
  message.data = points.data();
  message.data_size = points.size();
  LidarScan scan;
  PointCloudDecoder("log.bag", platform, warnings).decode(message, scan);
  EXPECT_EQ(scan.start, deskewed_stamp);
  EXPECT_EQ(scan.end, deskewed_stamp);
  EXPECT_EQ(scan.points.size(), 1500U);
}

TEST_F(DeskewedCloud, WithoutTheKeyTheErrorSuggestsIt) {
  EXPECT_THAT(refusal(with_times), HasSubstr(suggestion)) << "all points at one time";
  EXPECT_THAT(refusal(without_times), HasSubstr(suggestion)) << "no field of a time";
  platform.lidar.time_field = "t";
  EXPECT_THAT(refusal(without_times), HasSubstr(suggestion)) << "the named field is missing";
  platform.lidar.time_unit = PointTimeUnit::nanoseconds;
  EXPECT_THAT(refusal(with_times), HasSubstr(suggestion)) << "all points at one time, of a stated unit";
}

TEST_F(DeskewedCloud, TimesOfAWrongUnitDoNotSuggestIt) {
  LidarScan spinning = deskewed_scan();
  for (std::size_t i = 0; i < spinning.points.size(); ++i)
    spinning.points[i].offset_ns = static_cast<std::int32_t>(50'000 * i);
  platform.lidar.time_field = "t";
  platform.lidar.time_unit = PointTimeUnit::microseconds;
  EXPECT_THAT(refusal(CloudLayout{}.write(spinning, data)),
              ::testing::AllOf(HasSubstr("time_unit"), Not(HasSubstr("point_times"))));
}

}  // namespace
}  // namespace lodestone
