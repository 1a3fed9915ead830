#include "frontends/synchronizer/scan_merger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "core/lidar/scan_sampling.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/messages/cloud_layout.h"

namespace lodestone {
namespace {

using ::lodestone::testing::CloudLayout;
using ::lodestone::testing::TemporaryFolder;

constexpr Time period = 100'000'000;
constexpr Time first_start = 1'700'000'000'000'000'000;

/// The visible point at a given time, in the imu frame: each time has its own point.
Vector3 point_at(Time time) {
  const auto i = static_cast<double>((time - first_start) / 10'000 % 1000);
  return {3.0 + 0.004 * i, 2.0 - 0.003 * i, 0.5 + 0.001 * i};
}

/// A scan of `lidar` that begins at `start`; a point every 40 µs.
LidarScan scan_at(Time start, const Pose& T_imu_lidar) {
  LidarScan scan;
  scan.start = start;
  for (Time offset = 0; offset < period; offset += 40'000) {
    LidarPoint point;
    point.position = (T_imu_lidar.inverse() * point_at(start + offset)).cast<float>();
    point.offset_ns = static_cast<std::int32_t>(offset);
    scan.points.push_back(point);
    scan.end = start + offset;
  }
  return scan;
}

struct TwoLidars : ::testing::Test {
  TwoLidars() {
    front.T_imu_lidar = {so3::exp(Vector3(0.0, 0.1, 0.3)), Vector3(0.3, 0.0, 0.2)};
    rear.T_imu_lidar = {so3::exp(Vector3(0.2, 0.0, 3.0)), Vector3(-0.4, 0.1, 0.25)};
  }

  /// Every point is at the position of its time, and times are within the scan. Adds the scan's times to `seen`, and
  /// the points of each LiDAR to `counts`.
  void expect_right(const LidarScan& scan) {
    for (const LidarPoint& point : scan.points) {
      const Time time = scan.start + point.offset_ns;
      EXPECT_GE(point.offset_ns, 0);
      EXPECT_LE(time, scan.end);
      ASSERT_LT((front.T_imu_lidar * point.position.cast<double>() - point_at(time)).norm(), 5e-6);
      ++seen[time];
      ++counts[point.lidar];
    }
  }

  LidarModel front, rear;
  std::map<Time, int> seen;
  std::map<int, std::size_t> counts;
  WarningLog warnings;
};

TEST_F(TwoLidars, EveryPointJoinsTheScanOfItsTimeOnce) {
  ScanMerger merger(front, {rear}, warnings);
  const Time shift = 37'000'000 + 20'000;  // the two LiDARs are not synchronized
  std::vector<LidarScan> merged;
  LidarScan scan;
  for (int i = 0; i < 6; ++i) {
    merger.add(0, scan_at(first_start + i * period, front.T_imu_lidar));
    EXPECT_FALSE(merger.take(scan)) << "the other LiDAR has not come to its end";
    merger.add(1, scan_at(first_start + i * period + shift, rear.T_imu_lidar));
    if (merger.take(scan)) merged.push_back(scan);
  }
  merger.finish();
  while (merger.take(scan)) merged.push_back(scan);
  ASSERT_EQ(merged.size(), 6U);
  for (std::size_t i = 0; i < merged.size(); ++i) {
    EXPECT_EQ(merged[i].end, first_start + static_cast<Time>(i) * period + period - 40'000)
        << "the first LiDAR sets the pace";
    expect_right(merged[i]);
    for (const LidarPoint& point : merged[i].points) {
      const Time since_firing = (merged[i].start + point.offset_ns - first_start) % 40'000;
      ASSERT_EQ(point.lidar, since_firing == 0 ? 0 : 1) << "each point names the LiDAR that measured it";
    }
  }
  std::size_t points = 0;
  for (const auto& [time, count] : seen) {
    EXPECT_EQ(count, 1);
    ++points;
  }
  // All points of the first LiDAR, and those of the other up to the last end.
  EXPECT_EQ(points, 6U * 2500U + 6U * 2500U - static_cast<std::size_t>((shift + 40'000) / 40'000));
  EXPECT_TRUE(warnings.entries().empty());
}

TEST_F(TwoLidars, DeskewedScansAreJoinedWithinAPeriod) {
  ScanMerger merger(front, {rear}, warnings);
  const auto at_once = [](Time time, const Pose& T_imu_lidar) {
    LidarScan scan;
    scan.start = scan.end = time;
    scan.points.resize(7);
    for (LidarPoint& point : scan.points) point.position = (T_imu_lidar.inverse() * point_at(time)).cast<float>();
    return scan;
  };
  for (int i = 0; i < 5; ++i) {
    merger.add(0, at_once(first_start + i * period, front.T_imu_lidar));
    merger.add(1, at_once(first_start + i * period + 60'000'000, rear.T_imu_lidar));
  }
  merger.finish();
  std::size_t scans = 0;
  for (LidarScan scan; merger.take(scan); ++scans) {
    EXPECT_EQ(scan.end, first_start + static_cast<Time>(scans) * period);
    EXPECT_EQ(scan.points.size(), scans == 0 ? 7U : 14U);
    expect_right(scan);
  }
  EXPECT_EQ(scans, 5U);
  EXPECT_TRUE(warnings.entries().empty());
}

TEST_F(TwoLidars, OneThatIsSilentIsNotWaitedForLong) {
  ScanMerger merger(front, {rear}, warnings);
  LidarScan scan;
  int merged = 0;
  for (int i = 0; i < 20; ++i) {
    merger.add(0, scan_at(first_start + i * period, front.T_imu_lidar));
    while (merger.take(scan)) ++merged;
  }
  EXPECT_EQ(merged, 18);
  // Late points are dropped and counted, never added to another scan.
  merger.add(1, scan_at(first_start + 10 * period, rear.T_imu_lidar));
  merger.finish();
  while (merger.take(scan)) {
    ++merged;
    expect_right(scan);
  }
  EXPECT_EQ(merged, 20);
  EXPECT_EQ(warnings.count("lidar.unmerged_points"), 2500);
}

TEST_F(TwoLidars, WithoutTheFirstNothingPilesUp) {
  ScanMerger merger(front, {rear}, warnings);
  for (int i = 0; i < 1000; ++i) merger.add(1, scan_at(first_start + i * period, rear.T_imu_lidar));
  EXPECT_EQ(warnings.count("lidar.unmerged_points"), 990 * 2500);
}

TEST_F(TwoLidars, LimitsOfRangeAreEachLidarsOwn) {
  // All points are within 3.6 m to 7.1 m of the imu.
  front.max_range_m = 8.0;
  rear.T_imu_lidar.position = {-40.0, 0.1, 0.25};
  rear.min_range_m = 10.0;
  const auto kept = [&](double rear_min_m, double rear_max_m) {
    rear.min_range_m = rear_min_m;
    rear.max_range_m = rear_max_m;
    ScanMerger merger(front, {rear}, warnings);
    merger.add(1, scan_at(first_start, rear.T_imu_lidar));
    merger.add(0, scan_at(first_start, front.T_imu_lidar));
    LidarScan scan;
    EXPECT_TRUE(merger.take(scan));
    std::map<int, std::size_t> by_lidar;
    const LidarModel lidars[] = {front, rear};
    for (const LidarPoint& point : sample_scan(scan, lidars, {0.0, 0})) ++by_lidar[point.lidar];
    return by_lidar;
  };
  using ::testing::ElementsAre;
  using ::testing::Pair;
  EXPECT_THAT(kept(10.0, 50.0), ElementsAre(Pair(0, 2500U), Pair(1, 2500U)));
  EXPECT_THAT(kept(10.0, 20.0), ElementsAre(Pair(0, 2500U)));
  EXPECT_THAT(kept(48.0, 60.0), ElementsAre(Pair(0, 2500U)));
}

TEST_F(TwoLidars, AreReadFromOneLogWithLayoutsOfTheirOwn) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  const CloudLayout layouts[] = {
      {"t", ros1::PointField::uint32},
      {"timestamp", ros1::PointField::uint64, PointTimeUnit::nanoseconds, PointTimeZero::epoch}};
  {
    ros1::BagWriter writer(path, Codec::none);
    std::vector<std::uint8_t> data;
    for (int i = 0; i < 10; ++i) {
      const Time start = first_start + i * period;
      for (int k = 0; k < 20; ++k) {
        ros1::ImuMessage imu;
        imu.stamp = start + k * 5'000'000;
        imu.linear_acceleration = {0.0, 0.0, 9.80665};
        writer.write("/imu/data", imu.stamp, imu);
      }
      writer.write("/front", start + period, layouts[0].write(scan_at(start, front.T_imu_lidar), data));
      writer.write("/rear", start + period + 20'000'000,
                   layouts[1].write(scan_at(start + 20'000'000, rear.T_imu_lidar), data));
    }
    writer.close();
  }
  testing::write_text(folder / "two.yaml", R"(
name: two
gravity_m_s2: 9.80665
lidar:
  topic: /front
  stamp: start
  range_noise_m: 0.02
  min_range_m: 0.1
  max_range_m: 100
  scan_period_s: 0.1
  T_imu_lidar: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}
further_lidars:
  - topic: /rear
    min_range_m: 0.1
    max_range_m: 90
    scan_period_s: 0.1
    T_imu_lidar: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}
imu: {topic: /imu/data, rate_hz: 200, gyroscope_noise_density_rad_s_sqrt_hz: 1.0e-3,
  accelerometer_noise_density_m_s2_sqrt_hz: 2.0e-2,
  gyroscope_bias_random_walk_rad_s2_sqrt_hz: 2.0e-5, accelerometer_bias_random_walk_m_s3_sqrt_hz: 5.0e-4}
)");
  Platform platform = load_platform(folder / "two.yaml");
  platform.suite.lidar.T_imu_lidar = front.T_imu_lidar;
  platform.suite.further_lidars.at(0).T_imu_lidar = rear.T_imu_lidar;
  save_platform(platform, folder / "saved.yaml");
  platform = load_platform(folder / "saved.yaml");
  ASSERT_EQ(platform.further_lidars.size(), 1U);
  EXPECT_EQ(platform.suite.further_lidars[0].max_range_m, 90.0);
  EXPECT_FALSE(platform.further_lidars[0].stamp.has_value());
  BagSource source(path, platform, warnings, {.magnetometers = false});
  int scans = 0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (scan == nullptr) continue;
    expect_right(*scan);
    EXPECT_GT(scan->points.size(), scans == 0 ? 4000U : 4900U);
    ++scans;
  }
  EXPECT_EQ(scans, 10);
  EXPECT_EQ(counts[0], 10U * 2500U);
  EXPECT_GT(counts[1], 9U * 2500U);
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 2) << "once for each LiDAR";
}

}  // namespace
}  // namespace lodestone
