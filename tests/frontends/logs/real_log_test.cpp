// Logs of real robots, read by BagSource; skipped if the data is missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/frontends/logs/log_contents.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::Contents;
using ::lodestone::testing::message_of;
using ::lodestone::testing::read_all;
using ::lodestone::testing::SyntheticLog;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(RealLog, ABagWithoutMessagesGivesOneClearError) {
  LODESTONE_REAL_DATA(path, "bags/no-messages.bag");
  EXPECT_THAT(message_of<InputError>([&] { read_all(path, SyntheticLog{}.platform()); }), HasSubstr("has no messages"));
}

TEST(RealLog, ABagOfOtherTopicsNamesThem) {
  LODESTONE_REAL_DATA(path, "bags/example-lz4.bag");
  EXPECT_THAT(message_of<InputError>([&] { read_all(path, SyntheticLog{}.platform()); }),
              AllOf(HasSubstr("the log has no sensor_msgs/Imu"), HasSubstr("/turtle1/pose (turtlesim/Pose)")));
}

TEST(RealLog, OusterScansHaveTheirTimesAndRings) {
  LODESTONE_REAL_DATA(path, "bags/ouster_os1_128_ros1_bz2.bag");
  Platform platform;
  platform.imu.topic = "/ouster/imu";
  platform.suite.imu.rate_hz = 100.0;
  const Contents contents = read_all(path, platform);
  EXPECT_EQ(contents.imu.size(), 30U);
  ASSERT_EQ(contents.scans.size(), 3U);
  EXPECT_EQ(contents.warnings.count("lidar.packed_points"), 1);
  for (const LidarScan& scan : contents.scans) {
    EXPECT_GT(scan.points.size(), 100'000U);
    EXPECT_NEAR(to_seconds(scan.end - scan.start), 0.1, 0.005);
    int largest_ring = 0;
    int within = 0;
    for (const LidarPoint& point : scan.points) {
      largest_ring = std::max<int>(largest_ring, point.ring);
      within += point.position.norm() > 0.3F && point.position.norm() < 250.0F ? 1 : 0;
    }
    EXPECT_EQ(largest_ring, 127);
    EXPECT_EQ(within, static_cast<int>(scan.points.size()));
  }
}

TEST(RealLog, TheFieldOfADroneIsOfTheEarthsSize) {
  LODESTONE_REAL_DATA(path, "bags/ardrone_imu.bag");
  Platform platform;
  platform.imu.topic = "/ardrone/imu";
  platform.magnetometers = {{"/ardrone/mag", FieldUnit::tesla}};
  platform.suite.magnetometers.resize(1);
  const Contents contents = read_all(path, platform, {.lidar = false});
  EXPECT_GT(contents.imu.size(), 3000U);
  double sum = 0.0;
  for (const MagneticSample& sample : contents.fields) sum += sample.field_ut.norm();
  EXPECT_GT(sum / static_cast<double>(contents.fields.size()), 20.0);
  EXPECT_LT(sum / static_cast<double>(contents.fields.size()), 200.0);
}

}  // namespace
}  // namespace lodestone
