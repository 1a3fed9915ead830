// Runs on scans that the driver has deskewed: one time for all points, and no time field.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/geometry/trajectory.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/messages/cloud_layout.h"
#include "tests/tools/program_runner.h"
#include "tests/tools/run/office_world.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Interpolates the ground truth, which has the rate of the IMU.
Pose true_pose(const Trajectory& truth, Time time) {
  return interpolate(truth, std::clamp(time, truth.front().time, truth.back().time), 20'000'000).value();
}

double rms_error_mm(const Trajectory& found, const Trajectory& truth) {
  double sum = 0.0;
  for (const StampedPose& each : found)
    sum += (true_pose(truth, each.time).position - each.pose.position).squaredNorm();
  return 1e3 * std::sqrt(sum / static_cast<double>(found.size()));
}

class DeskewedScansRun : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(base_ + "/office.yaml") << office_world;
    const ProgramResult result =
        run_lodestone("simulate " + base_ + "/office.yaml --duration 1.6 --only log,cloud --out " + base_);
    ASSERT_EQ(result.code, 0) << result.errors;
    truth_ = read_trajectory(base_ + "/truth.tum");
    platform_ = load_platform(base_ + "/platform.yaml");
    write_deskewed();
  }

  /// Writes the log with every scan deskewed to its end by the ground truth, as by a driver with exact odometry.
  void write_deskewed() {
    WarningLog warnings;
    BagSource source(base_ + "/log.bag", platform_, warnings, {.magnetometers = false});
    ros1::BagWriter writer(base_ + "/deskewed.bag", Codec::none);
    std::vector<std::uint8_t> data;
    for (Measurement measurement; source.next(measurement);) {
      if (const auto* imu = std::get_if<ImuSample>(&measurement)) {
        const Vector3 &turn = imu->angular_velocity, &force = imu->linear_acceleration;
        ros1::ImuMessage message;
        message.stamp = imu->time;
        message.angular_velocity = {turn.x(), turn.y(), turn.z()};
        message.linear_acceleration = {force.x(), force.y(), force.z()};
        writer.write(platform_.imu.topic, imu->time, message);
      } else if (auto* scan = std::get_if<LidarScan>(&measurement)) {
        const Pose& T_imu_lidar = platform_.suite.lidar.T_imu_lidar;
        const Pose T_lidar_map = (true_pose(truth_, scan->end) * T_imu_lidar).inverse();
        for (LidarPoint& point : scan->points) {
          const Pose T_end_then = T_lidar_map * true_pose(truth_, scan->start + point.offset_ns) * T_imu_lidar;
          point.position = (T_end_then * point.position.cast<double>()).cast<float>();
          point.offset_ns = 0;
        }
        scan->start = scan->end;
        ros1::PointCloudMessage message = testing::CloudLayout{}.write(*scan, data);
        message.fields.pop_back();  // the field of times
        writer.write(platform_.lidar.topic, scan->end, message);
      }
    }
    writer.close();
    Platform deskewed = platform_;
    deskewed.lidar.time_field.clear();
    deskewed.lidar.time_unit.reset();
    deskewed.lidar.point_times = PointTimes::none;
    save_platform(deskewed, base_ + "/deskewed.yaml");
    deskewed.lidar.point_times = PointTimes::field;
    save_platform(deskewed, base_ + "/without_key.yaml");
  }

  ProgramResult call(const std::string& log, const std::string& platform, const std::string& estimator,
                     const std::string& out) const {
    return run_lodestone("run " + base_ + "/" + log + " --platform " + base_ + "/" + platform + " --cloud " + base_ +
                         "/cloud.pcd --initial-pose-from " + base_ + "/truth.tum --estimator " + estimator + " --out " +
                         base_ + "/" + out);
  }

  TemporaryFolder folder_;
  std::string base_ = folder_.path().string();
  Trajectory truth_;
  Platform platform_;
};

TEST_F(DeskewedScansRun, IsAsGoodAsWithTimesOfPoints) {
  for (const std::string estimator : {"smoother", "ieskf"}) {
    SCOPED_TRACE(estimator);
    const ProgramResult usual = call("log.bag", "platform.yaml", estimator, "usual");
    const ProgramResult deskewed = call("deskewed.bag", "deskewed.yaml", estimator, "deskewed");
    ASSERT_EQ(usual.code, 0) << usual.errors;
    ASSERT_EQ(deskewed.code, 0) << deskewed.errors;
    EXPECT_THAT(deskewed.output + deskewed.errors, Not(HasSubstr("lidar.silent")));
    const Trajectory expected = read_trajectory(base_ + "/usual/" + estimator + "/trajectory.tum");
    const Trajectory found = read_trajectory(base_ + "/deskewed/" + estimator + "/trajectory.tum");
    ASSERT_EQ(found.size(), expected.size()) << "one pose a scan, no outages between";
    const double usual_mm = rms_error_mm(expected, truth_), deskewed_mm = rms_error_mm(found, truth_);
    EXPECT_LT(deskewed_mm, 1.5 * usual_mm);
    std::printf("%s: rms %.3f mm deskewed, %.3f mm with times of points\n", estimator.c_str(), deskewed_mm, usual_mm);
  }
}

TEST_F(DeskewedScansRun, WithoutTheKeyTheLineNamesIt) {
  const ProgramResult result = call("deskewed.bag", "without_key.yaml", "smoother", "refused");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("lidar.point_times: none"));
}

TEST_F(DeskewedScansRun, CheckFindsNoFaultInTheirTimes) {
  const std::string rest = " --cloud " + base_ + "/cloud.pcd --initial-pose-from " + base_ + "/truth.tum";
  const ProgramResult result =
      run_lodestone("check " + base_ + "/deskewed.bag --platform " + base_ + "/deskewed.yaml" + rest);
  EXPECT_EQ(result.code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, Not(HasSubstr("lidar.point_time")));
  EXPECT_THAT(result.output, Not(HasSubstr("lidar.silent")));
}

}  // namespace
}  // namespace lodestone
