// The level of the map, by the first scan and the accelerometer.
#include "tools/check/initial_pose_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimators/factory.h"
#include "frontends/maps/plane_map_loader.h"
#include "localization/initial_pose.h"
#include "tests/tools/check/check_site.h"
#include "tools/check/scan_odometry.h"

namespace lodestone {
namespace {

/// The first scan of the hall, and an accelerometer that reads a steady forward acceleration of 0.6 m/s²: gravity
/// seems to be tilted by 3.5 degrees.
class CheckLevel : public ::testing::Test {
 protected:
  CheckLevel() {
    WarningLog warnings;
    sample_ = read_log_sample(site().log(""), site().platform(), 0.5, warnings);
    odometry_.first_scan = follow_scans(sample_.scans(), site().platform().suite.lidar).first_scan;
    begin_ = sample_.scans().front().start;
    sample_.imu.clear();
    for (int i = 0; i < 1000; ++i) {
      sample_.imu.push_back({begin_ + from_seconds(0.005 * i), Vector3::Zero(), Vector3(acceleration_m_s2, 0.0, 9.8)});
    }
  }

  /// The scans' path at this acceleration, from rest.
  void drive(double along_x_m_s2) {
    odometry_.poses.clear();
    for (int i = 0; i < 20; ++i) {
      const double time_s = 0.05 + 0.1 * i;
      const Vector3 position(0.5 * along_x_m_s2 * time_s * time_s, 0.0, 0.0);
      odometry_.poses.push_back({begin_ + from_seconds(time_s), Pose{Quaternion::Identity(), position}});
    }
  }

  bool finds_tilt() const {
    WarningLog warnings;
    const Platform& platform = site().platform();
    const auto planes = load_planes(site().file("cloud.pcd"), RunOptions{}.lidar.map, platform.suite.lidars(),
                                    site().file(""), warnings)
                            .source;
    const Trajectory truth = read_trajectory(site().file("truth.tum"));
    const Pose start = initial_pose_from(truth, "truth", odometry_.poses.front().time);
    return has(check_initial_pose({sample_, platform, odometry_, *planes, start, nullptr}), "start.tilt",
               Severity::error);
  }

  static constexpr double acceleration_m_s2 = 0.6;
  LogSample sample_;
  ScanOdometry odometry_;
  Time begin_ = 0;
};

TEST_F(CheckLevel, SteadyAccelerationIsNoTilt) {
  drive(acceleration_m_s2);
  EXPECT_FALSE(finds_tilt());
}

TEST_F(CheckLevel, ATiltAtRestIsAnError) {
  drive(0.0);
  EXPECT_TRUE(finds_tilt());
}

TEST_F(CheckLevel, RestIsUnknownIfTheScansDoNotObserveEachDirection) {
  drive(0.0);
  odometry_.first_degenerate = odometry_.poses[1].time;
  EXPECT_FALSE(finds_tilt());
}

}  // namespace
}  // namespace lodestone
