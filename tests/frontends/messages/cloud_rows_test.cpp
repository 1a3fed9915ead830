// Layouts of PointCloud2's data: padded rows, and points that are closer together than announced.
#include <gtest/gtest.h>

#include <cstring>

#include "core/error.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/messages/cloud_layout.h"

namespace lodestone {
namespace {

using ::lodestone::testing::CloudLayout;

LidarScan scan_of_rows(int scan) {
  LidarScan result;
  result.start = 1'700'000'000'000'000'000 + scan * 100'000'000LL;
  for (int i = 0; i < 2048; ++i) {
    LidarPoint point;
    point.position = Eigen::Vector3f(1.0F + 0.01F * static_cast<float>(i), static_cast<float>(scan), 2.0F);
    point.intensity = static_cast<float>(i % 100);
    point.offset_ns = 48'000 * i;
    point.ring = static_cast<std::uint16_t>(i / 512);
    result.points.push_back(point);
  }
  result.end = result.start + result.points.back().offset_ns;
  return result;
}

class CloudRows : public ::testing::Test {
 protected:
  CloudRows() {
    platform_.file = "robot.yaml";
    platform_.lidar.topic = "/points";
    platform_.lidar.time_field = layout_.field;
    platform_.lidar.time_unit = layout_.unit;
    platform_.lidar.time_zero = layout_.zero;
    platform_.lidar.stamp = layout_.stamp;
  }

  void expect_read(PointCloudDecoder& decoder, const ros1::PointCloudMessage& message, const LidarScan& scan) {
    LidarScan read;
    decoder.decode(message, read);
    EXPECT_EQ(read.start, scan.start);
    ASSERT_EQ(read.points.size(), scan.points.size());
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      ASSERT_EQ(read.points[i].position, scan.points[i].position) << i;
      ASSERT_EQ(read.points[i].ring, scan.points[i].ring) << i;
      ASSERT_EQ(read.points[i].offset_ns, scan.points[i].offset_ns) << i;
    }
  }

  /// The same points without gaps between the fields, although the message announces gaps.
  ros1::PointCloudMessage write_packed(const LidarScan& scan, std::vector<std::uint8_t>& data) const {
    ros1::PointCloudMessage message = layout_.write(scan, data);
    std::vector<std::uint8_t> packed;
    for (auto point = data.begin(); point != data.end(); point += CloudLayout::point_step) {
      packed.insert(packed.end(), point, point + 18);
      packed.insert(packed.end(), point + 24, point + 28);
    }
    data.swap(packed);
    message.data = data.data();
    message.data_size = data.size();
    return message;
  }

  CloudLayout layout_;
  Platform platform_;
  WarningLog warnings_;
};

TEST_F(CloudRows, PaddedOnesAreReadRowByRow) {
  PointCloudDecoder decoder("log.bag", platform_, warnings_);
  for (int i = 0; i < 3; ++i) {
    const LidarScan scan = scan_of_rows(i);
    std::vector<std::uint8_t> data, padded;
    ros1::PointCloudMessage message = layout_.write(scan, data);
    message.height = 4;
    message.width = 512;
    const std::size_t row_bytes = std::size_t{512} * CloudLayout::point_step;
    message.row_step = static_cast<std::uint32_t>(row_bytes) + 48;
    for (std::size_t row = 0; row < 4; ++row) {
      padded.insert(padded.end(), data.begin() + static_cast<std::ptrdiff_t>(row * row_bytes),
                    data.begin() + static_cast<std::ptrdiff_t>((row + 1) * row_bytes));
      padded.insert(padded.end(), 48, 0xAA);
    }
    message.data = padded.data();
    message.data_size = padded.size();
    expect_read(decoder, message, scan);
    // Some drivers write the size of the whole cloud as the size of a row; there is no padding then.
    message.row_step = static_cast<std::uint32_t>(data.size());
    message.data = data.data();
    message.data_size = data.size();
    expect_read(decoder, message, scan);
  }
  EXPECT_TRUE(warnings_.entries().empty());
}

TEST_F(CloudRows, HowPointsLieIsNotToldFromAnEmptyScan) {
  PointCloudDecoder decoder("log.bag", platform_, warnings_);
  std::vector<std::uint8_t> data;
  LidarScan empty = scan_of_rows(0), read;
  empty.points.clear();
  for (int i = 0; i < 2; ++i) decoder.decode(layout_.write(empty, data), read);
  EXPECT_TRUE(read.points.empty());
  for (int i = 1; i < 4; ++i) expect_read(decoder, write_packed(scan_of_rows(i), data), scan_of_rows(i));
  EXPECT_EQ(warnings_.count("lidar.packed_points"), 1);
}

TEST_F(CloudRows, HowPointsLieIsToldAnewWhereTheSizeContradicts) {
  PointCloudDecoder decoder("log.bag", platform_, warnings_);
  std::vector<std::uint8_t> data;
  for (int i = 0; i < 6; ++i) {
    const LidarScan scan = scan_of_rows(i);
    expect_read(decoder, i % 2 == 0 ? layout_.write(scan, data) : write_packed(scan, data), scan);
  }
}

}  // namespace
}  // namespace lodestone
