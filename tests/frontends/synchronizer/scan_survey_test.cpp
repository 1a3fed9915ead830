#include "frontends/synchronizer/scan_survey.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/frontends/synchronizer/listed_source.h"

namespace lodestone {
namespace {

LidarPoint point_of_lidar(float x, float y, std::int32_t offset_ns, std::uint8_t lidar = 0) {
  LidarPoint point;
  point.position = {x, y, 0.0F};
  point.offset_ns = offset_ns;
  point.lidar = lidar;
  return point;
}

LidarScan scan_between(Time start, Time end, std::vector<LidarPoint> points) {
  LidarScan scan;
  scan.start = start;
  scan.end = end;
  scan.points = std::move(points);
  return scan;
}

/// Two LiDARs half a metre before and behind the IMU; the second one faces back.
SensorSuite two_lidars() {
  SensorSuite suite;
  suite.lidar.T_imu_lidar.position = {0.5, 0.0, 0.0};
  suite.lidar.max_range_m = 10.0;
  LidarModel rear;
  rear.T_imu_lidar = {so3::exp(Vector3(0.0, 0.0, std::numbers::pi)), Vector3(-0.5, 0.0, 0.0)};
  rear.max_range_m = 5.0;
  suite.further_lidars.push_back(rear);
  return suite;
}

/// Reads all rays of a drive of 1 mm/ns along y, with a gap from 1000 to 5000 ns.
ScanSurvey read_drive(std::vector<Measurement> measurements, std::vector<LidarRay>& rays) {
  const auto pose_at = [](Time time) {
    return StampedPose{time, {Quaternion::Identity(), Vector3(0.0, 1e-3 * static_cast<double>(time), 0.0)}};
  };
  const Trajectory trajectory{pose_at(0), pose_at(500), pose_at(1000), pose_at(5000), pose_at(5500)};
  testing::ListedSource source(std::move(measurements));
  return read_scans(source, trajectory, two_lidars(), 1000,
                    [&rays](std::span<const LidarRay> scan) { rays.insert(rays.end(), scan.begin(), scan.end()); });
}

TEST(ScanSurvey, PutsEachPointWhereTheLidarMeasuredIt) {
  std::vector<LidarRay> rays;
  // The merged scan has all points in the frame of the first LiDAR.
  const ScanSurvey survey = read_drive(
      {ImuSample{},
       scan_between(100, 900, {point_of_lidar(2, 0, 0), point_of_lidar(2, 0, 800), point_of_lidar(-3, 0, 400, 1)})},
      rays);
  EXPECT_EQ(survey.scans, 1);
  EXPECT_EQ(survey.points, 3);
  ASSERT_EQ(rays.size(), 3U);
  EXPECT_LT((rays[0].end - Eigen::Vector3f(2.5F, 0.1F, 0.0F)).norm(), 1e-6F);
  EXPECT_LT((rays[0].origin - Eigen::Vector3f(0.5F, 0.1F, 0.0F)).norm(), 1e-6F);
  EXPECT_LT((rays[1].end - Eigen::Vector3f(2.5F, 0.9F, 0.0F)).norm(), 1e-6F) << "the pose at the point's own time";
  EXPECT_LT((rays[2].end - Eigen::Vector3f(-2.5F, 0.5F, 0.0F)).norm(), 1e-6F);
  EXPECT_LT((rays[2].origin - Eigen::Vector3f(-0.5F, 0.5F, 0.0F)).norm(), 1e-6F) << "of the second LiDAR";
}

TEST(ScanSurvey, LimitsTheRangeOfEachLidarFromItsOwnOrigin) {
  std::vector<LidarRay> rays;
  const ScanSurvey survey =
      read_drive({scan_between(100, 900,
                               {point_of_lidar(9, 0, 0), point_of_lidar(11, 0, 0), point_of_lidar(0.2F, 0, 0),
                                point_of_lidar(-5.5F, 0, 0, 1), point_of_lidar(-6.5F, 0, 0, 1)})},
                 rays);
  EXPECT_EQ(survey.points, 2);
  EXPECT_EQ(survey.out_of_range, 3);
}

TEST(ScanSurvey, CountsTheGapsOfTheTrajectory) {
  std::vector<LidarRay> rays;
  const auto points = [] { return std::vector<LidarPoint>{point_of_lidar(2, 0, 0), point_of_lidar(2, 0, 300)}; };
  const ScanSurvey survey = read_drive(
      {scan_between(600, 900, points()), scan_between(900, 1200, points()), scan_between(3000, 3300, points()),
       scan_between(5100, 5400, points()), scan_between(6000, 6300, points())},
      rays);
  EXPECT_EQ(survey.points, 5);
  EXPECT_EQ(survey.without_pose, 5);
  ASSERT_EQ(survey.gaps.size(), 2U);
  EXPECT_EQ(survey.gaps[0].begin, 900);
  EXPECT_EQ(survey.gaps[0].end, 3300);
  EXPECT_EQ(survey.gaps[1].begin, 6000);
}

}  // namespace
}  // namespace lodestone
