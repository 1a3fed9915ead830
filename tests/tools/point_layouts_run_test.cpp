#include <gtest/gtest.h>

#include <fstream>

#include "frontends/readers/bag_source.h"
#include "frontends/readers/ros1/bag_writer.h"
#include "frontends/readers/trajectory_file.h"
#include "tests/frontends/readers/cloud_layout.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using Field = ros1::PointField;

constexpr const char* office = R"(
name: office
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 16, columns: 512, min_range_m: 0.1, max_range_m: 40}
cloud: {point_spacing_m: 0.1}
solids:
  - {shape: box, at_m: [0, 0, 1.5], size_m: [14, 10, 3]}
  - {shape: box, at_m: [2, 3, 1], size_m: [1, 2, 2]}
sequences:
  short: {waypoints_m: [[-2, -2], [3, -2]], speed: [[0, 1.5]], rest_s: 0.5}
)";

std::array<double, 3> as_array(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// The simulated log with its scans written in another way.
void rewrite(const std::string& from, const Platform& platform, const testing::CloudLayout& layout, const std::string& to) {
  WarningLog warnings;
  BagSource source(from, platform, warnings, {.magnetometers = false});
  ros1::BagWriter writer(to, ros1::Compression::none);
  std::vector<std::uint8_t> data;
  for (Measurement measurement; source.next(measurement);) {
    if (const auto* scan = std::get_if<LidarScan>(&measurement)) {
      writer.write(platform.lidar.topic, scan->end, layout.write(*scan, data));
    } else if (const auto* imu = std::get_if<ImuSample>(&measurement)) {
      ros1::ImuMessage message;
      message.stamp = imu->time;
      message.angular_velocity = as_array(imu->angular_velocity);
      message.linear_acceleration = as_array(imu->linear_acceleration);
      writer.write(platform.imu.topic, imu->time, message);
    }
  }
  writer.close();
}

/// As vendors write them; the platform file says nothing of the cloud but, where no content tells it, the stamp.
TEST(PointLayoutsRun, EveryVendorsCloudGivesTheSameTrajectoryToAMillimetre) {
  const TemporaryFolder folder;
  const std::string base = folder.path().string();
  std::ofstream(folder / "office.yaml") << office;
  ProgramResult result = run_lodestone("simulate " + base + "/office.yaml --duration 3 --only log,cloud --out " + base);
  ASSERT_EQ(result.code, 0) << result.errors;
  const Platform platform = load_platform(base + "/platform.yaml");
  struct Case {
    const char* name;
    testing::CloudLayout layout;
    bool stamp_needed;
  };
  const Case cases[] = {
      {"velodyne", {"time", Field::float32, PointTimeUnit::seconds, PointTimeZero::stamp, ScanStamp::end}, false},
      {"hesai", {"timestamp", Field::float64, PointTimeUnit::seconds, PointTimeZero::epoch, ScanStamp::middle}, false},
      {"robosense", {"timestamp", Field::float64, PointTimeUnit::seconds, PointTimeZero::scan_start, ScanStamp::end}, true},
      {"livox", {"offset_time", Field::uint32, PointTimeUnit::nanoseconds, PointTimeZero::scan_start, ScanStamp::start}, false},
      {"own clock", {"time_stamp", Field::uint32, PointTimeUnit::microseconds, PointTimeZero::lidar_clock, ScanStamp::middle}, true},
  };
  const auto run = [&](const std::string& log, const std::string& platform_file, const std::string& out) {
    const ProgramResult ran = run_lodestone("run " + log + " --platform " + platform_file + " --cloud " + base + "/cloud.pcd --initial-pose-from " +
                                            base + "/truth.tum --estimator smoother --out " + out);
    EXPECT_EQ(ran.code, 0) << ran.errors;
    return read_trajectory(out + "/smoother/trajectory.tum");
  };
  const Trajectory expected = run(base + "/log.bag", base + "/platform.yaml", base + "/run");
  ASSERT_GT(expected.size(), 20U);
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    testing::CloudLayout layout = each.layout;
    layout.clock_origin = expected.front().time - 1'000'000'000'000;
    rewrite(base + "/log.bag", platform, layout, base + "/vendor.bag");
    Platform untold = platform;
    untold.lidar.intensity_field.clear();
    untold.lidar.ring_field.clear();
    untold.lidar.time_field.clear();
    untold.lidar.time_unit.reset();
    untold.lidar.stamp.reset();
    if (each.stamp_needed) untold.lidar.stamp = each.layout.stamp;
    save_platform(untold, base + "/untold.yaml");
    const Trajectory found = run(base + "/vendor.bag", base + "/untold.yaml", base + "/vendor");
    ASSERT_EQ(found.size(), expected.size());
    double worst_m = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_LE(std::abs(found[i].time - expected[i].time), 2000);
      worst_m = std::max(worst_m, (found[i].pose.position - expected[i].pose.position).norm());
    }
    EXPECT_LT(worst_m, 1e-3);
    RecordProperty(std::string("worst_mm_") + each.name, std::to_string(1e3 * worst_m));
  }
}

}  // namespace
}  // namespace lodestone
