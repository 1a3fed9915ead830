#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/messages/cloud_layout.h"
#include "tests/tools/program_runner.h"
#include "tests/tools/run/office_world.h"
#include "tests/tools/run/vendor_cloud.h"

namespace lodestone {
namespace {

using Field = ros1::PointField;

std::array<double, 3> as_array(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

void write_imu(ros1::BagWriter& writer, const Platform& platform, const ImuSample& sample) {
  ros1::ImuMessage message;
  message.stamp = sample.time;
  message.angular_velocity = as_array(sample.angular_velocity);
  message.linear_acceleration = as_array(sample.linear_acceleration);
  writer.write(platform.imu.topic, sample.time, message);
}

/// Writes the log with each scan written by `write`.
template <class WriteScan>
void write_log(const std::vector<Measurement>& log, const Platform& platform, const std::string& to,
               const WriteScan& write) {
  ros1::BagWriter writer(to, Codec::none);
  std::vector<std::uint8_t> data;
  for (const Measurement& measurement : log) {
    if (const auto* scan = std::get_if<LidarScan>(&measurement)) {
      writer.write(platform.lidar.topic, scan->end, write(*scan, data));
    } else {
      write_imu(writer, platform, std::get<ImuSample>(measurement));
    }
  }
  writer.close();
}

std::vector<Measurement> measurements_of(const std::string& log, const Platform& platform) {
  WarningLog warnings;
  BagSource source(log, platform, warnings, {.magnetometers = false});
  std::vector<Measurement> found;
  for (Measurement measurement; source.next(measurement);) found.push_back(measurement);
  return found;
}

/// Points in order of firing, or ring by ring, which is not the order of time.
LidarScan arranged(LidarScan scan, bool by_ring) {
  std::stable_sort(scan.points.begin(), scan.points.end(), [by_ring](const LidarPoint& a, const LidarPoint& b) {
    return by_ring && a.ring != b.ring ? a.ring < b.ring : a.offset_ns < b.offset_ns;
  });
  return scan;
}

/// All data of the scans that estimators use, as bytes. Ring and intensity are not included, because not every vendor
/// writes them.
std::string seen_of(const std::vector<Measurement>& log) {
  std::string bytes;
  const auto add = [&bytes](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (const Measurement& measurement : log) {
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (scan == nullptr) continue;
    add(scan->start);
    add(scan->end);
    for (const LidarPoint& point : scan->points) {
      for (const int i : {0, 1, 2}) add(point.position[i]);
      add(point.offset_ns);
    }
  }
  return bytes;
}

/// The simulated log with every second point of a scan assigned to a second LiDAR at `rear`.
void split(const std::string& from, const Platform& platform, const Pose& T_imu_rear, const std::string& to) {
  WarningLog warnings;
  BagSource source(from, platform, warnings, {.magnetometers = false});
  ros1::BagWriter writer(to, Codec::none);
  const testing::CloudLayout front_layout,
      rear_layout{"timestamp", Field::uint64, PointTimeUnit::nanoseconds, PointTimeZero::epoch};
  const Pose T_rear_front = T_imu_rear.inverse() * platform.suite.lidar.T_imu_lidar;
  std::vector<std::uint8_t> data;
  for (Measurement measurement; source.next(measurement);) {
    if (const auto* scan = std::get_if<LidarScan>(&measurement)) {
      LidarScan front = *scan, rear = *scan;
      front.points.clear();
      rear.points.clear();
      for (std::size_t i = 0; i < scan->points.size(); ++i) {
        LidarPoint point = scan->points[i];
        // The last firing is assigned to the first LiDAR, which determines the scan's end.
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

/// A small office and a drive of a second and a half with few beams: many runs take seconds.
class PointLayoutsRun : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "office.yaml") << office_world;
    const ProgramResult result =
        run_lodestone("simulate " + base_ + "/office.yaml --duration 1.6 --only log,cloud --out " + base_);
    ASSERT_EQ(result.code, 0) << result.errors;
    platform_ = load_platform(base_ + "/platform.yaml");
    log_ = measurements_of(base_ + "/log.bag", platform_);
    expected_ = run(base_ + "/log.bag", base_ + "/platform.yaml", "run");
    ASSERT_GT(expected_.size(), 12U);
  }

  Trajectory run(const std::string& log, const std::string& platform, const std::string& out) const {
    const ProgramResult ran =
        run_lodestone("run " + log + " --platform " + platform + " --cloud " + base_ + "/cloud.pcd " +
                      "--initial-pose-from " + base_ + "/truth.tum --estimator smoother --out " + base_ + "/" + out);
    EXPECT_EQ(ran.code, 0) << ran.errors;
    return read_trajectory(base_ + "/" + out + "/smoother/trajectory.tum");
  }

  /// A platform file without information on the cloud, except for the stamp if the content does not determine it.
  Platform minimal_platform(PointTimeZero zero, ScanStamp stamp) const {
    Platform platform = platform_;
    platform.lidar.intensity_field.clear();
    platform.lidar.ring_field.clear();
    platform.lidar.time_field.clear();
    platform.lidar.time_unit.reset();
    platform.lidar.stamp.reset();
    const bool counts = zero == PointTimeZero::scan_start || zero == PointTimeZero::lidar_clock;
    if (counts && stamp != ScanStamp::start) platform.lidar.stamp = stamp;
    return platform;
  }

  TemporaryFolder folder_;
  std::string base_ = folder_.path().string();
  Platform platform_;
  std::vector<Measurement> log_;
  Trajectory expected_;
};

/// Largest difference of a trajectory to another, at its own times. For comparison: half a scan too late at 1 m/s is 50
/// mm.
struct Apart {
  double time_us = 0.0;
  double position_mm = 0.0;
};

Vector3 position_at(const Trajectory& trajectory, Time time) {
  std::size_t next = 1;
  while (next + 1 < trajectory.size() && trajectory[next].time < time) ++next;
  const StampedPose &before = trajectory[next - 1], &after = trajectory[next];
  const double share = static_cast<double>(time - before.time) / static_cast<double>(after.time - before.time);
  return before.pose.position + share * (after.pose.position - before.pose.position);
}

Apart apart(const Trajectory& found, const Trajectory& expected) {
  EXPECT_EQ(found.size(), expected.size());
  Apart worst;
  for (std::size_t i = 0; i < std::min(found.size(), expected.size()); ++i) {
    worst.time_us = std::max(worst.time_us, 1e-3 * std::abs(static_cast<double>(found[i].time - expected[i].time)));
    worst.position_mm =
        std::max(worst.position_mm, 1e3 * (found[i].pose.position - position_at(expected, found[i].time)).norm());
  }
  return worst;
}

/// Vendors' fields x zero of the times x time of the stamp x order of points and no-returns. Cases with bitwise equal
/// scans share one run.
TEST_F(PointLayoutsRun, EveryVendorsCloudGivesTheSameTrajectoryToAMillimetre) {
  using testing::Arrangement;
  int cells = 0;
  std::map<std::string, Apart> runs;  // by the scans as read
  const Time clock_origin = expected_.front().time - 1'000'000'000'000;
  const std::vector<testing::VendorCloud> vendors = testing::vendor_clouds();
  for (const testing::VendorCloud& vendor : vendors) {
    Apart worst;
    for (const PointTimeZero zero : vendor.zeros) {
      for (const ScanStamp stamp : {ScanStamp::start, ScanStamp::middle, ScanStamp::end}) {
        for (const auto arrangement :
             {Arrangement::firing_order, Arrangement::rings_with_zeros, Arrangement::rings_with_nan}) {
          SCOPED_TRACE(fmt::format("{}, {}, arrangement {}", vendor.name, describe({vendor.unit, zero, stamp, false}),
                                   static_cast<int>(arrangement)));
          const bool by_ring = arrangement != Arrangement::firing_order;
          write_log(log_, platform_, base_ + "/vendor.bag",
                    [&](const LidarScan& scan, std::vector<std::uint8_t>& data) {
                      return vendor.write(arranged(scan, by_ring), zero, stamp, arrangement, clock_origin, data);
                    });
          const Platform platform = minimal_platform(zero, stamp);
          save_platform(platform, base_ + "/minimal.yaml");
          const auto [place, is_new] = runs.try_emplace(seen_of(measurements_of(base_ + "/vendor.bag", platform)));
          if (is_new) place->second = apart(run(base_ + "/vendor.bag", base_ + "/minimal.yaml", "vendor"), expected_);
          EXPECT_LT(place->second.position_mm, 1.0);
          EXPECT_LT(place->second.time_us, 2.0);
          worst.position_mm = std::max(worst.position_mm, place->second.position_mm);
          worst.time_us = std::max(worst.time_us, place->second.time_us);
          ++cells;
        }
      }
    }
    std::printf("%s: %.6f mm, %.3f us\n", vendor.name, worst.position_mm, worst.time_us);
  }
  std::printf("%d cells, %zu runs\n", cells, runs.size());
  EXPECT_GE(cells, 100);
}

/// Effect of a misread layout in this matrix: a stamp in the middle of the scan that is interpreted as the start.
TEST_F(PointLayoutsRun, HalfAScanTooLateIsSeen) {
  const std::vector<testing::VendorCloud> vendors = testing::vendor_clouds();
  write_log(log_, platform_, base_ + "/vendor.bag", [&](const LidarScan& scan, std::vector<std::uint8_t>& data) {
    return vendors.front().write(arranged(scan, false), PointTimeZero::scan_start, ScanStamp::middle,
                                 testing::Arrangement::firing_order, 0, data);
  });
  save_platform(minimal_platform(PointTimeZero::scan_start, ScanStamp::start), base_ + "/minimal.yaml");
  const Apart found = apart(run(base_ + "/vendor.bag", base_ + "/minimal.yaml", "vendor"), expected_);
  EXPECT_GT(found.time_us, 40e3);
  EXPECT_GT(found.position_mm, 20.0);
}

TEST_F(PointLayoutsRun, TwoLidarsThatShareTheBeamsAreAsGoodAsOne) {
  LidarMessageLayout rear;
  rear.topic = "/rear/points";
  rear.intensity_field.clear();
  rear.ring_field.clear();
  rear.time_field.clear();
  rear.time_unit.reset();
  LidarModel model = platform_.suite.lidar;
  model.T_imu_lidar = {so3::exp(Vector3(0.1, -0.2, 3.0)), Vector3(-0.4, 0.1, 0.35)};
  split(base_ + "/log.bag", platform_, model.T_imu_lidar, base_ + "/two.bag");
  Platform two = platform_;
  two.further_lidars = {rear};
  two.suite.further_lidars = {model};
  save_platform(two, base_ + "/two.yaml");
  // The same points in another order: thinning selects other points, so that only the errors can be similar.
  const Trajectory truth = read_trajectory(base_ + "/truth.tum");
  const auto rms_mm = [&](const Trajectory& found) {
    double sum = 0.0;
    for (const StampedPose& each : found) {
      const auto nearest =
          std::min_element(truth.begin(), truth.end(), [&](const StampedPose& a, const StampedPose& b) {
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
