// What the decoder infers from a cloud, written to a platform file, gives the same scan.
#include <gtest/gtest.h>

#include "frontends/messages/point_cloud_decoder.h"
#include "tests/frontends/messages/cloud_layout.h"

namespace lodestone {
namespace {

using ros1::PointField;
using testing::CloudLayout;

/// All points of a scan of 0.1 s.
LidarScan determinable_scan() {
  LidarScan scan;
  scan.start = 1'700'000'000'000'000'000;
  scan.end = scan.start + 99'000'000;
  for (int i = 0; i < 2000; ++i) {
    LidarPoint& point = scan.points.emplace_back();
    point.position = Eigen::Vector3f(5.0F + 0.001F * static_cast<float>(i), 1.0F, -0.5F);
    point.offset_ns = static_cast<std::int32_t>(99'000'000LL * i / 1999);
  }
  return scan;
}

Platform with_layout(const LidarMessageLayout& layout) {
  Platform platform;
  platform.lidar = layout;
  return platform;
}

LidarMessageLayout open_layout() {
  return {"/points", std::nullopt, "", "", "", std::nullopt, std::nullopt};
}

class DeterminedLayout : public ::testing::TestWithParam<CloudLayout> {};

TEST_P(DeterminedLayout, ReadsTheSameScan) {
  const CloudLayout& cloud = GetParam();
  std::vector<std::uint8_t> data;
  const ros1::PointCloudMessage message = cloud.write(determinable_scan(), data);
  WarningLog warnings;
  PointCloudDecoder inferring("log", with_layout(open_layout()), warnings);
  EXPECT_FALSE(inferring.determined_layout());
  LidarScan expected;
  inferring.decode(message, expected);
  const std::optional<LidarMessageLayout> layout = inferring.determined_layout();
  ASSERT_TRUE(layout);
  EXPECT_EQ(layout->time_field, cloud.field);
  EXPECT_EQ(layout->time_unit, cloud.unit);
  EXPECT_EQ(layout->time_zero, cloud.zero);
  EXPECT_EQ(layout->intensity_field, "intensity");
  EXPECT_EQ(layout->ring_field, "ring");

  LidarMessageLayout stated = *layout;
  stated.stamp = stated.stamp.value_or(ScanStamp::start);
  WarningLog unheard;
  PointCloudDecoder told("log", with_layout(stated), unheard);
  LidarScan scan;
  told.decode(message, scan);
  EXPECT_EQ(unheard.count("lidar.told_from_content"), 0);
  EXPECT_EQ(scan.start, expected.start);
  EXPECT_EQ(scan.end, expected.end);
  ASSERT_EQ(scan.points.size(), expected.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    ASSERT_EQ(scan.points[i].offset_ns, expected.points[i].offset_ns);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Drivers, DeterminedLayout,
    ::testing::Values(CloudLayout{},
                      CloudLayout{"time", PointField::float32, PointTimeUnit::seconds, PointTimeZero::scan_start},
                      CloudLayout{"timestamp", PointField::float64, PointTimeUnit::seconds, PointTimeZero::epoch},
                      CloudLayout{"time", PointField::float32, PointTimeUnit::seconds, PointTimeZero::stamp,
                                  ScanStamp::end}));

TEST(DeterminedLayoutOfDeskewedScans, NamesNoTimes) {
  std::vector<std::uint8_t> data;
  const ros1::PointCloudMessage message = CloudLayout{}.write(determinable_scan(), data);
  LidarMessageLayout deskewed = open_layout();
  deskewed.point_times = PointTimes::none;
  WarningLog warnings;
  PointCloudDecoder decoder("log", with_layout(deskewed), warnings);
  LidarScan scan;
  decoder.decode(message, scan);
  const std::optional<LidarMessageLayout> layout = decoder.determined_layout();
  ASSERT_TRUE(layout);
  EXPECT_EQ(layout->point_times, PointTimes::none);
  EXPECT_EQ(layout->time_field, "");
  EXPECT_FALSE(layout->time_unit);
}

}  // namespace
}  // namespace lodestone
