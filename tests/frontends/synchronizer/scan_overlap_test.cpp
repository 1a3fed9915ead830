// Scans that overlap, as of two LiDARs on one topic.
#include <gtest/gtest.h>

#include <algorithm>

#include "frontends/synchronizer/synchronizer.h"
#include "tests/frontends/synchronizer/listed_source.h"

namespace lodestone {
namespace {

constexpr Time kMillisecond = 1'000'000;
constexpr Time kBegin = 1'700'000'000'000'000'000;
constexpr std::size_t kPoints = 100;  // of a scan

/// A scan of 99 ms that begins `ns` after kBegin, with a point each millisecond, but none later than `last_ms` after
/// its begin.
LidarScan timed_scan(Time ns, int last_ms = 99) {
  LidarScan scan;
  scan.start = kBegin + ns;
  scan.end = scan.start + 99 * kMillisecond;
  scan.points.resize(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i) {
    scan.points[i].offset_ns = static_cast<std::int32_t>(std::min(static_cast<int>(i), last_ms) * kMillisecond);
  }
  return scan;
}

/// The bundles of the scans, with an IMU at 200 Hz over a second.
std::vector<ScanBundle> bundles_of(const std::vector<LidarScan>& scans, WarningLog& warnings) {
  std::vector<Measurement> all(scans.begin(), scans.end());
  for (Time t = -2 * kMillisecond; t <= 1050 * kMillisecond; t += 5 * kMillisecond) {
    all.emplace_back(ImuSample{kBegin + t, Vector3::Zero(), Vector3(0, 0, 9.8)});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Measurement& a, const Measurement& b) { return completion_time(a) < completion_time(b); });
  testing::ListedSource source(std::move(all));
  Synchronizer synchronizer(source, SensorSuite{}, warnings);
  std::vector<ScanBundle> result;
  for (ScanBundle bundle; synchronizer.next(bundle);) result.push_back(bundle);
  return result;
}

TEST(ScanOverlap, PointsFromBeforeThePreviousScansEndAreDiscarded) {
  std::vector<LidarScan> scans;
  for (Time ms = 0; ms < 1000; ms += 100) {
    scans.push_back(timed_scan(ms * kMillisecond));
    if (ms < 900) scans.push_back(timed_scan((ms + 40) * kMillisecond));
  }
  WarningLog warnings;
  const auto result = bundles_of(scans, warnings);
  ASSERT_EQ(result.size(), 19U);
  for (std::size_t k = 1; k < result.size(); ++k) {
    const LidarScan& scan = result[k].scan;
    EXPECT_EQ(scan.start, result[k - 1].scan.end);
    EXPECT_EQ(scan.points.size(), k % 2 == 1 ? 40U : 60U);
    for (const LidarPoint& point : scan.points) EXPECT_GT(scan.start + point.offset_ns, result[k - 1].scan.end);
    EXPECT_EQ(scan.start + scan.points.back().offset_ns, scan.end);
  }
  EXPECT_EQ(warnings.count("lidar.overlap"), 9 * 60 + 9 * 40);
}

TEST(ScanOverlap, AScanThatAddsHardlyAnyTimeIsDiscarded) {
  std::vector<LidarScan> scans;
  for (Time ms = 0; ms < 1000; ms += 100) {
    scans.push_back(timed_scan(ms * kMillisecond));
    scans.push_back(timed_scan(ms * kMillisecond + 10'000));  // synchronized LiDARs
  }
  WarningLog warnings;
  const auto result = bundles_of(scans, warnings);
  ASSERT_EQ(result.size(), 10U);
  for (const ScanBundle& bundle : result) EXPECT_EQ(bundle.scan.points.size(), kPoints);
  EXPECT_EQ(warnings.count("lidar.overlap"), 10 * static_cast<std::int64_t>(kPoints));
}

TEST(ScanOverlap, StampsThatJitterAndScansWithoutTimesKeepTheirPoints) {
  std::vector<LidarScan> scans;
  for (Time ms = 0; ms < 1000; ms += 100) scans.push_back(timed_scan((ms % 200 == 0 ? ms : ms - 8) * kMillisecond));
  scans[5] = timed_scan(480 * kMillisecond, 0);  // all points have the time of the start
  WarningLog warnings;
  const auto result = bundles_of(scans, warnings);
  ASSERT_EQ(result.size(), 10U);
  for (const ScanBundle& bundle : result) EXPECT_EQ(bundle.scan.points.size(), kPoints);
  EXPECT_FALSE(warnings.entries().contains("lidar.overlap"));
}

}  // namespace
}  // namespace lodestone
