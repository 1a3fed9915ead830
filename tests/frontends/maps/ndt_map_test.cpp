#include "frontends/maps/ndt_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::testing::HasSubstr;

constexpr double kReach_m = 20.0;

/// A hall of 60 × 12 × 4 m whose long walls have a niche every 9 m, so that no direction is degenerate.
std::vector<Eigen::Vector3f> niched_hall() {
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  std::normal_distribution<float> noise(0.0F, 0.005F);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 150000; ++i) {
    const float x = 60.0F * uniform(generator);
    const float z = 4.0F * uniform(generator);
    const float side = uniform(generator) < 0.5F ? 0.0F : 12.0F;
    const float niche = std::fmod(x, 9.0F) < 3.0F ? 1.0F : 0.0F;
    switch (i % 4) {
      case 0:
        points.emplace_back(x, 12.0F * uniform(generator), noise(generator));
        break;
      case 1:  // across: the ends, and the sides of niches
        points.emplace_back(9.0F * std::floor(x / 9.0F) + (z < 2.0F ? 0.0F : 3.0F) + noise(generator),
                            side + (side > 0.0F ? 1.0F : -1.0F) * uniform(generator), z);
        break;
      default:
        points.emplace_back(x, side + (side > 0.0F ? niche : -niche) + noise(generator), z);
        break;
    }
  }
  for (Eigen::Vector3f& point : points) point += Eigen::Vector3f(0.37F, 0.41F, 0.23F);  // off the faces of cells
  return points;
}

VoxelMeans thinned(const std::vector<Eigen::Vector3f>& points, const NdtOptions& options = {}) {
  VoxelMeans means(options.thinning_m);
  for (const Eigen::Vector3f& point : points) means.add(point);
  return means;
}

/// One of 40 points within 12 m of the sensor, in its frame.
std::vector<Eigen::Vector3f> scan_at(const Pose& T_map_imu, const std::vector<Eigen::Vector3f>& cloud) {
  std::vector<Eigen::Vector3f> scan;
  const Pose to_sensor = T_map_imu.inverse();
  for (std::size_t i = 0; i < cloud.size(); i += 40) {
    const Vector3 point = to_sensor * cloud[i].cast<double>();
    if (point.norm() < 12.0) scan.push_back(point.cast<float>());
  }
  return scan;
}

Pose place(double x, double y, double yaw) {
  return {Quaternion(Eigen::AngleAxisd(yaw, Vector3::UnitZ())), Vector3(x, y, 1.0)};
}

struct NdtMapTest : ::testing::Test {
  const std::vector<Eigen::Vector3f> cloud = niched_hall();
  NdtMap map{thinned(cloud), NdtOptions{}, kReach_m};
};

/// The optimum of NDT with cells of 1 m is centimetres from the pose, and iterations end near the optimum.
TEST_F(NdtMapTest, FindsThePoseOfAScanFromAGuessNearby) {
  for (const Pose& truth : {place(20.0, 6.0, 0.0), place(31.5, 4.0, 2.0), place(40.0, 8.0, -3.0)}) {
    Vector6 offset;
    offset << 0.01, -0.01, 0.02, 0.1, -0.08, 0.04;
    const auto match = map.match(scan_at(truth, cloud), truth.boxplus(offset));
    ASSERT_TRUE(match);
    const Vector6 error = match->T_map_imu.boxminus(truth);
    EXPECT_LT(error.head<3>().norm(), 0.6 * offset.head<3>().norm());
    EXPECT_LT(error.tail<3>().norm(), 0.6 * offset.tail<3>().norm());
    EXPECT_GT(match->iterations, 1);
    EXPECT_GT(match->matched, match->points * 9 / 10);
  }
}

/// A rotation alone moves no translation, which must not end the iterations.
TEST_F(NdtMapTest, TurnsBackAGuessThatIsOnlyTurned) {
  const Pose truth = place(31.0, 5.0, 0.5);
  Vector6 turn = Vector6::Zero();
  turn[2] = 0.03;
  const auto match = map.match(scan_at(truth, cloud), truth.boxplus(turn));
  ASSERT_TRUE(match);
  EXPECT_LT(match->T_map_imu.boxminus(truth).head<3>().norm(), 0.01);
}

/// Tiles do not cut cells: a reach that contains the whole map gives the same pose but for the order of sums.
TEST_F(NdtMapTest, TheTilesWithinReachGiveThePoseOfTheWholeMap) {
  NdtMap whole(thinned(cloud), NdtOptions{}, 1000.0);
  for (const double x : {10.0, 31.9, 32.1, 50.0}) {
    const Pose truth = place(x, 6.0, 1.0);
    const std::vector<Eigen::Vector3f> scan = scan_at(truth, cloud);
    const Pose guess = truth.boxplus(Vector6::Constant(0.03));
    const auto near = map.match(scan, guess);
    const auto all = whole.match(scan, guess);
    ASSERT_TRUE(near && all);
    EXPECT_LT(near->T_map_imu.boxminus(all->T_map_imu).norm(), 1e-5) << x;
    EXPECT_EQ(near->matched, all->matched);
  }
}

TEST_F(NdtMapTest, SameBitsWhateverWasRegisteredBeforeAndOnAnyNumberOfThreads) {
  const Pose truth = place(33.0, 6.0, 1.0);
  const std::vector<Eigen::Vector3f> scan = scan_at(truth, cloud);
  const Pose guess = truth.boxplus(Vector6::Constant(0.03));
  const auto first = map.match(scan, guess);
  ASSERT_TRUE(first);
  for (const double x : {5.0, 20.0, 36.0, 55.0}) map.match(scan, place(x, -80.0 + 3.0 * x, 0.0));
  const auto again = map.match(scan, guess);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->T_map_imu.position, first->T_map_imu.position);
  EXPECT_EQ(again->T_map_imu.rotation.coeffs(), first->T_map_imu.rotation.coeffs());

  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  NdtMap alone(thinned(cloud), NdtOptions{}, kReach_m);
  const auto by_one_thread = alone.match(scan, guess);
  ASSERT_TRUE(by_one_thread);
  EXPECT_EQ(by_one_thread->T_map_imu.position, first->T_map_imu.position);
  EXPECT_EQ(by_one_thread->T_map_imu.rotation.coeffs(), first->T_map_imu.rotation.coeffs());
}

TEST_F(NdtMapTest, FarFromTheMapAndWithoutPointsThereIsNoPose) {
  const std::vector<Eigen::Vector3f> scan = scan_at(place(20.0, 6.0, 0.0), cloud);
  EXPECT_FALSE(map.match({}, place(20.0, 6.0, 0.0)));
  EXPECT_FALSE(map.match(scan, place(20.0, 500.0, 0.0)));       // no tile
  EXPECT_FALSE(map.match(scan, place(20.0, 6.0 + 30.0, 0.0)));  // a tile, but no cell at the points
  EXPECT_FALSE(map.match(scan, place(1e9, 6.0, 0.0)));
  EXPECT_FALSE(map.match(scan, place(std::numeric_limits<double>::quiet_NaN(), 6.0, 0.0)));
}

TEST_F(NdtMapTest, AFileIsThinnedWhileItIsRead) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "hall.pcd").string();
  std::vector<Eigen::Vector3f> twice = cloud;
  twice.insert(twice.end(), cloud.begin(), cloud.end());
  write_point_cloud(file, twice);
  WarningLog warnings;
  LidarModel lidar;
  lidar.max_range_m = 10.0;
  const auto loaded = load_ndt_map(file, NdtOptions{}, std::span(&lidar, 1), warnings);
  EXPECT_EQ(loaded->points(), thinned(cloud).size());
  EXPECT_TRUE(warnings.entries().empty());
  EXPECT_THAT(message_of<InputError>([&] { load_ndt_map("none.pcd", NdtOptions{}, std::span(&lidar, 1), warnings); }),
              HasSubstr("none.pcd"));
}

/// Beyond the reach of the thinning's voxels, where floats are 8 mm apart.
TEST_F(NdtMapTest, FindsThePoseOfAScanInAMapFarFromItsOrigin) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "hall.pcd").string();
  const Vector3 place_m(110'000.0, -112'000.0, 500.0);
  std::vector<Eigen::Vector3f> moved = cloud;
  for (Eigen::Vector3f& point : moved) point += place_m.cast<float>();
  write_point_cloud(file, moved);
  WarningLog warnings;
  LidarModel lidar;
  lidar.max_range_m = 10.0;
  const auto far = load_ndt_map(file, NdtOptions{}, std::span(&lidar, 1), warnings);
  EXPECT_TRUE(warnings.entries().empty());
  const Pose truth = place(31.5, 4.0, 2.0);
  Pose there = truth;
  there.position += place_m;
  Vector6 offset;
  offset << 0.01, -0.01, 0.02, 0.1, -0.08, 0.04;
  const auto match = far->match(scan_at(truth, cloud), there.boxplus(offset));
  ASSERT_TRUE(match);
  const Vector6 error = match->T_map_imu.boxminus(there);
  EXPECT_LT(error.head<3>().norm(), 0.6 * offset.head<3>().norm());
  EXPECT_LT(error.tail<3>().norm(), 0.6 * offset.tail<3>().norm());
  EXPECT_GT(match->matched, match->points * 9 / 10);
}

TEST_F(NdtMapTest, PointsBeyondTheRangeOfVoxelsAreCounted) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "hall.pcd").string();
  std::vector<Eigen::Vector3f> points = cloud;
  points.emplace_back(20000.0F, 0.0F, 0.0F);
  write_point_cloud(file, points);
  NdtOptions options;
  options.thinning_m = 0.01;
  WarningLog warnings;
  const LidarModel lidar;
  load_ndt_map(file, options, std::span(&lidar, 1), warnings);
  ASSERT_EQ(warnings.entries().count("cloud.far_points"), 1U);
  EXPECT_EQ(warnings.entries().at("cloud.far_points").count, 1);
}

}  // namespace
}  // namespace lodestone
