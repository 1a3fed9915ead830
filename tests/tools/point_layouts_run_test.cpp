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

void write_imu(ros1::BagWriter& writer, const Platform& platform, const ImuSample& sample) {
  ros1::ImuMessage message;
  message.stamp = sample.time;
  message.angular_velocity = as_array(sample.angular_velocity);
  message.linear_acceleration = as_array(sample.linear_acceleration);
  writer.write(platform.imu.topic, sample.time, message);
}

/// The simulated log with its scans written in another way.
void rewrite(const std::string& from, const Platform& platform, const testing::CloudLayout& layout, const std::string& to) {
  WarningLog warnings;
  BagSource source(from, platform, warnings, {.magnetometers = false});
  ros1::BagWriter writer(to, ros1::Compression::none);
  std::vector<std::uint8_t> data;
  for (Measurement measurement; source.next(measurement);) {
    if (const auto* scan = std::get_if<LidarScan>(&measurement)) {
      writer.write(platform.lidar.topic, scan->end, layout.write(*scan, data));
    } else {
      write_imu(writer, platform, std::get<ImuSample>(measurement));
    }
  }
  writer.close();
}

/// The simulated log with every other point of a scan seen by a second LiDAR at `rear`.
void split(const std::string& from, const Platform& platform, const Pose& T_imu_rear, const std::string& to) {
  WarningLog warnings;
  BagSource source(from, platform, warnings, {.magnetometers = false});
  ros1::BagWriter writer(to, ros1::Compression::none);
  const testing::CloudLayout front_layout, rear_layout{"timestamp", Field::uint64, PointTimeUnit::nanoseconds, PointTimeZero::epoch};
  const Pose T_rear_front = T_imu_rear.inverse() * platform.suite.lidar.T_imu_lidar;
  std::vector<std::uint8_t> data;
  for (Measurement measurement; source.next(measurement);) {
    if (const auto* scan = std::get_if<LidarScan>(&measurement)) {
      LidarScan front = *scan, rear = *scan;
      front.points.clear();
      rear.points.clear();
      for (std::size_t i = 0; i < scan->points.size(); ++i) {
        LidarPoint point = scan->points[i];
        // The last firing stays with the first LiDAR, which sets the scan's end.
        const bool last = scan->start + point.offset_ns == scan->end;
        if (i % 2 == 0 || last) {
          front.points.push_back(point);
        } else {
          point.position = (T_rear_front * point.position.cast<double>()).cast<float>();
          rear.points.push_back(point);
        }
      }
      writer.write(platform.lidar.topic, scan->end, front_layout.write(front, data));
      writer.write("/rear/points", scan->end, rear_layout.write(rear, data));
    } else {
      write_imu(writer, platform, std::get<ImuSample>(measurement));
    }
  }
  writer.close();
}

/// A small office, driven through for three seconds.
class PointLayoutsRun : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "office.yaml") << office;
    const ProgramResult result = run_lodestone("simulate " + base_ + "/office.yaml --duration 3 --only log,cloud --out " + base_);
    ASSERT_EQ(result.code, 0) << result.errors;
    platform_ = load_platform(base_ + "/platform.yaml");
    expected_ = run(base_ + "/log.bag", base_ + "/platform.yaml", "run");
    ASSERT_GT(expected_.size(), 20U);
  }

  Trajectory run(const std::string& log, const std::string& platform, const std::string& out) const {
    const ProgramResult ran = run_lodestone("run " + log + " --platform " + platform + " --cloud " + base_ + "/cloud.pcd " +
                                            "--initial-pose-from " + base_ + "/truth.tum --estimator smoother --out " + base_ + "/" + out);
    EXPECT_EQ(ran.code, 0) << ran.errors;
    return read_trajectory(base_ + "/" + out + "/smoother/trajectory.tum");
  }

  /// The largest distance from the run on the log as it was simulated, mm.
  double worst_mm(const Trajectory& found) const {
    EXPECT_EQ(found.size(), expected_.size());
    double worst = 0.0;
    for (std::size_t i = 0; i < std::min(found.size(), expected_.size()); ++i) {
      EXPECT_LE(std::abs(found[i].time - expected_[i].time), 2000);
      worst = std::max(worst, 1e3 * (found[i].pose.position - expected_[i].pose.position).norm());
    }
    return worst;
  }

  TemporaryFolder folder_;
  std::string base_ = folder_.path().string();
  Platform platform_;
  Trajectory expected_;
};

/// As vendors write them; the platform file says nothing of the cloud but, where no content tells it, the stamp.
TEST_F(PointLayoutsRun, EveryVendorsCloudGivesTheSameTrajectoryToAMillimetre) {
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
      {"own_clock", {"time_stamp", Field::uint32, PointTimeUnit::microseconds, PointTimeZero::lidar_clock, ScanStamp::middle}, true},
  };
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    testing::CloudLayout layout = each.layout;
    layout.clock_origin = expected_.front().time - 1'000'000'000'000;
    rewrite(base_ + "/log.bag", platform_, layout, base_ + "/vendor.bag");
    Platform untold = platform_;
    untold.lidar.intensity_field.clear();
    untold.lidar.ring_field.clear();
    untold.lidar.time_field.clear();
    untold.lidar.time_unit.reset();
    untold.lidar.stamp.reset();
    if (each.stamp_needed) untold.lidar.stamp = each.layout.stamp;
    save_platform(untold, base_ + "/untold.yaml");
    const double worst = worst_mm(run(base_ + "/vendor.bag", base_ + "/untold.yaml", "vendor"));
    EXPECT_LT(worst, 1.0);
    std::printf("%s: %.6f mm\n", each.name, worst);
  }
}

TEST_F(PointLayoutsRun, TwoLidarsThatShareTheBeamsAreAsGoodAsOne) {
  FurtherLidar rear;
  rear.layout.topic = "/rear/points";
  rear.layout.intensity_field.clear();
  rear.layout.ring_field.clear();
  rear.layout.time_field.clear();
  rear.layout.time_unit.reset();
  rear.model = platform_.suite.lidar;
  rear.model.T_imu_lidar = {so3::exp(Vector3(0.1, -0.2, 3.0)), Vector3(-0.4, 0.1, 0.35)};
  split(base_ + "/log.bag", platform_, rear.model.T_imu_lidar, base_ + "/two.bag");
  Platform two = platform_;
  two.further_lidars = {rear};
  save_platform(two, base_ + "/two.yaml");
  // The same points in another order: thinning takes others of them, so that only the errors can be alike.
  const Trajectory truth = read_trajectory(base_ + "/truth.tum");
  const auto rms_mm = [&](const Trajectory& found) {
    double sum = 0.0;
    for (const StampedPose& each : found) {
      const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const StampedPose& a, const StampedPose& b) {
        return std::abs(a.time - each.time) < std::abs(b.time - each.time);
      });
      sum += (nearest->pose.position - each.pose.position).squaredNorm();
    }
    return 1e3 * std::sqrt(sum / static_cast<double>(found.size()));
  };
  const Trajectory found = run(base_ + "/two.bag", base_ + "/two.yaml", "two");
  ASSERT_EQ(found.size(), expected_.size());
  const double one = rms_mm(expected_), both = rms_mm(found);
  EXPECT_LT(both, 1.5 * one);
  std::printf("two LiDARs: rms %.3f mm, one: %.3f mm\n", both, one);
}

}  // namespace
}  // namespace lodestone
