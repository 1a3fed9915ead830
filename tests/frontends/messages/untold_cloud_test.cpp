#include <gtest/gtest.h>

#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

std::vector<LidarScan> scans_of(const std::string& path, const Platform& platform, WarningLog& warnings) {
  BagSource source(path, platform, warnings, {.magnetometers = false});
  std::vector<LidarScan> scans;
  for (Measurement measurement; source.next(measurement);) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) scans.push_back(std::move(*scan));
  }
  return scans;
}

TEST(RealUntoldCloud, OusterScansTellTheirTimesThemselves) {
  LODESTONE_REAL_DATA(path, "bags/ouster_os1_128_ros2_mcap");
  Platform platform;
  platform.imu.topic = "/ouster/imu";
  platform.suite.imu.rate_hz = 100.0;
  WarningLog warnings;
  const std::vector<LidarScan> stated = scans_of(path, platform, warnings);
  platform.lidar.stamp.reset();
  platform.lidar.time_unit.reset();
  platform.lidar.time_field.clear();
  platform.lidar.intensity_field.clear();
  platform.lidar.ring_field.clear();
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 0);
  const std::vector<LidarScan> inferred = scans_of(path, platform, warnings);
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 1);
  ASSERT_EQ(inferred.size(), stated.size());
  for (std::size_t k = 0; k < stated.size(); ++k) {
    EXPECT_EQ(inferred[k].start, stated[k].start);
    ASSERT_EQ(inferred[k].points.size(), stated[k].points.size());
    for (std::size_t i = 0; i < stated[k].points.size(); ++i) {
      ASSERT_EQ(inferred[k].points[i].offset_ns, stated[k].points[i].offset_ns);
      ASSERT_EQ(inferred[k].points[i].ring, stated[k].points[i].ring);
    }
  }
}

}  // namespace
}  // namespace lodestone
