// The odometry of `lodestone check`, compared with the ground truth in shipped worlds with sparse scans.
#include "tools/check/scan_odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "core/lidar/scan_sampling.h"
#include "tools/simulate/simulation_source.h"
#include "tools/simulate/world.h"

namespace lodestone {
namespace {

struct Drive {
  std::vector<LidarScan> scans;  // thinned as `check` does
  LidarModel lidar;
  Trajectory truth;  // T_map_imu
};

Drive drive_through(const std::string& name, double seconds) {
  const simulation::World world = simulation::load_world(LODESTONE_SOURCE_DIR "/config/worlds/" + name + ".yaml", {});
  const auto& [sequence_name, sequence] = *world.sequences.begin();
  const auto environment = std::make_shared<const simulation::Environment>(world, sequence.scene);
  simulation::SimulationSource source(world, environment, sequence_name, simulation::SimulationSource::Drive::sequence,
                                      3, seconds);
  Drive drive;
  drive.lidar = simulation::sensor_suite(world).lidar;
  drive.truth = source.trajectory();
  for (Measurement measurement; source.next(measurement);) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) {
      scan->points = sample_scan(*scan, drive.lidar, {0.2, 4000});
      drive.scans.push_back(std::move(*scan));
    }
  }
  return drive;
}

class ScanOdometryIn : public ::testing::TestWithParam<const char*> {};

/// In a tunnel, between racks and on a quay, few points of one scan define planes, and the tunnel has a degenerate
/// direction. The turns are tracked nevertheless. They are those of the scans' middles, not a quarter of a scan late as
/// at the ends.
TEST_P(ScanOdometryIn, FollowsTheTurnsToTheEndAndInTime) {
  const Drive drive = drive_through(GetParam(), 12.0);
  const ScanOdometry odometry = follow_scans(drive.scans, drive.lidar);
  EXPECT_FALSE(odometry.lost);
  ASSERT_EQ(odometry.poses.size(), drive.scans.size());
  const Quaternion& mount = drive.lidar.T_imu_lidar.rotation;
  const auto turn_rate = [&](Time from, Time until) {
    const Pose a = *interpolate(drive.truth, from, from_seconds(0.1));
    const Pose b = *interpolate(drive.truth, until, from_seconds(0.1));
    return Vector3(mount.conjugate() * so3::log(a.rotation.conjugate() * b.rotation) / to_seconds(until - from));
  };
  double sum = 0.0, cross = 0.0, power = 0.0, count = 0.0;
  const Time shift = from_seconds(0.01);
  for (std::size_t i = 2; i + 2 < odometry.poses.size(); ++i) {
    const StampedPose& a = odometry.poses[i - 1];
    const StampedPose& b = odometry.poses[i];
    const Vector3 rate = so3::log(a.pose.rotation.conjugate() * b.pose.rotation) / to_seconds(b.time - a.time);
    const Vector3 error = rate - turn_rate(a.time, b.time);
    const Vector3 change =
        (turn_rate(a.time + shift, b.time + shift) - turn_rate(a.time - shift, b.time - shift)) / 0.02;
    sum += error.squaredNorm();
    cross -= error.dot(change);
    power += change.squaredNorm();
    count += 3.0;
  }
  const double rms = std::sqrt(sum / count);
  std::printf("%s: rates are off by %.4f rad/s rms an axis, late by %.1f ms\n", GetParam(), rms, 1e3 * cross / power);
  EXPECT_LT(rms, 0.005);
  EXPECT_LT(std::abs(cross / power), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Worlds, ScanOdometryIn, ::testing::Values("tunnel", "warehouse", "seaport"));

TEST(ScanOdometry, StatesThatATunnelHasADegenerateDirection) {
  const Drive drive = drive_through("tunnel", 2.0);
  EXPECT_TRUE(follow_scans(drive.scans, drive.lidar).first_degenerate.has_value());
}

/// Three seconds without a scan: the following motion is tracked separately.
TEST(ScanOdometry, StartsAnewAfterAnOutage) {
  Drive drive = drive_through("warehouse", 10.0);
  const Time begin = drive.scans.front().start;
  const auto is_out = [begin](const LidarScan& scan) {
    return scan.start > begin + from_seconds(4.0) && scan.start < begin + from_seconds(7.0);
  };
  const std::size_t all = drive.scans.size();
  drive.scans.erase(std::remove_if(drive.scans.begin(), drive.scans.end(), is_out), drive.scans.end());
  ASSERT_LT(drive.scans.size(), all);
  const ScanOdometry odometry = follow_scans(drive.scans, drive.lidar);
  EXPECT_FALSE(odometry.lost);
  EXPECT_EQ(odometry.poses.size(), drive.scans.size());
}

/// A robot that falls over, or a recorder that is carried elsewhere.
TEST(ScanOdometry, EndsWhereTheScansAreNoneOfOnePlace) {
  const Drive tunnel = drive_through("tunnel", 1.0);
  Drive mixed = tunnel;
  const std::vector<LidarScan> others = drive_through("warehouse", 1.0).scans;
  const Time later = tunnel.scans.back().end - others.front().start;
  for (LidarScan scan : others) {
    scan.start += later;
    scan.end += later;
    const Eigen::Matrix3f fallen = so3::exp(Vector3(0.6, 0.6, 0.0)).toRotationMatrix().cast<float>();
    for (LidarPoint& point : scan.points) point.position = fallen * point.position;
    mixed.scans.push_back(scan);
  }
  const ScanOdometry odometry = follow_scans(mixed.scans, mixed.lidar);
  EXPECT_TRUE(odometry.lost);
  EXPECT_EQ(odometry.poses.size(), tunnel.scans.size());  // the first scan of the other place fits too badly
}

}  // namespace
}  // namespace lodestone
