// A map in tiles equals the whole map: identical planes, of which only those around the robot are in memory.
#include "frontends/maps/tiled_plane_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "core/error.h"
#include "core/thread_limit.h"
#include "frontends/maps/plane_map_loader.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A hall along x from −20 m on: floor, two walls, and clutter without planes; in random order, as after merging
/// surveys.
std::vector<Eigen::Vector3f> hall(float length_m, int points_a_metre, std::uint32_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  std::normal_distribution<float> noise(0.0F, 0.006F);
  std::vector<Eigen::Vector3f> points;
  const int count = static_cast<int>(length_m) * points_a_metre;
  for (int i = 0; i < count; ++i) {
    const float x = -20.0F + length_m * uniform(generator);
    const float y = -3.0F + 6.0F * uniform(generator);
    const float z = 4.0F * uniform(generator);
    switch (i % 8) {
      case 0:
        points.emplace_back(x, -3.02F + noise(generator), z);
        break;
      case 1:
        points.emplace_back(x, 3.1F + noise(generator), z);
        break;
      case 2:
        points.emplace_back(std::round(x), y, z);
        break;  // thin screens across
      case 3:
        points.emplace_back(x, y, z);
        break;
      default:
        points.emplace_back(x, y, 0.05F * std::sin(x) + noise(generator));
        break;
    }
  }
  return points;
}

PlaneMapOptions small_tiles() {
  PlaneMapOptions options;
  options.tile_m = 7.0;
  return options;
}

std::shared_ptr<const TiledPlaneMap> tiled(const std::vector<Eigen::Vector3f>& points, const PlaneMapOptions& options,
                                           const TemporaryFolder& folder, double reach_m) {
  TiledPlaneMapBuilder builder(options, folder.path().string(), 100000);  // a buffer that overflows many times
  const std::span<const Eigen::Vector3f> all(points);
  for (std::size_t i = 0; i < points.size(); i += 5000)
    builder.add(all.subspan(i, std::min<std::size_t>(5000, points.size() - i)));
  return builder.build(reach_m);
}

::testing::AssertionResult same(const Plane* a, const Plane* b) {
  if (a == nullptr || b == nullptr) {
    return a == b ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << "only one finds a plane";
  }
  static_assert(sizeof(Plane) == 14 * 4, "no padding: bytes can be compared");
  return std::memcmp(a, b, sizeof(Plane)) == 0 ? ::testing::AssertionSuccess()
                                               : ::testing::AssertionFailure() << "the planes differ";
}

TEST(TiledPlaneMap, GivesTheBitsOfTheWholeMap) {
  const std::vector<Eigen::Vector3f> points = hall(80.0F, 3000, 1);
  const TemporaryFolder folder;
  const auto whole = std::make_shared<const PlaneMap>(points, small_tiles());
  const auto source = tiled(points, small_tiles(), folder, 10.0);
  ASSERT_GT(source->tiles(), 20U);
  EXPECT_EQ(static_cast<std::size_t>(source->planes()), whole->planes().size());
  int rejected = 0;  // voxels with points but no plane
  whole->for_each_voxel([&](const Eigen::Vector3i&, const Plane* plane) { rejected += plane == nullptr; });
  EXPECT_GT(rejected, 1000);

  std::mt19937_64 generator(2);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  int found = 0;
  for (int place = 0; place < 60; ++place) {
    const Eigen::Vector3f robot(-25.0F + 1.5F * static_cast<float>(place), 2.0F * uniform(generator), 0.5F);
    const auto around = source->around(robot.cast<double>());
    EXPECT_EQ(around->thickness().median_m, whole->thickness().median_m);
    EXPECT_EQ(around->thickness().low_m, whole->thickness().low_m);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3f step(7.0F * uniform(generator), 7.0F * uniform(generator), 2.0F * uniform(generator));
      // Half of the points are on surfaces, on and beside planes.
      Eigen::Vector3f point = robot + step;
      if (i % 2 == 0) point.z() = 0.05F * std::sin(point.x()) + 0.05F * uniform(generator);
      ASSERT_TRUE(same(around->match(point, 0.3F), whole->match(point, 0.3F))) << point.transpose();
      ASSERT_TRUE(same(around->at(point), whole->at(point))) << point.transpose();
      found += whole->match(point, 0.3F) != nullptr;
    }
  }
  EXPECT_GT(found, 5000);  // enough for the comparison
}

TEST(TiledPlaneMap, MemoryIsBoundedByTheRadiusNotByTheMap) {
  const std::vector<Eigen::Vector3f> points = hall(400.0F, 1000, 3);
  const TemporaryFolder folder;
  const auto source = tiled(points, small_tiles(), folder, 10.0);
  std::size_t most = 0;
  for (double x = -20.0; x < 380.0; x += 0.1) most = std::max(most, source->around({x, 0, 0.5})->planes().size());
  // 13.5 m, and at most one tile to either side, of 400 m.
  EXPECT_LT(most, 41.0 / 400.0 * 1.1 * static_cast<double>(source->planes()));
  // One load at the start, then one per half tile.
  EXPECT_LE(source->loads(), static_cast<std::int64_t>(1 + 400.0 / 3.5));
  EXPECT_GE(source->loads(), 100);
}

/// With a second thread, the next tiles are there when the robot leaves the old ones, on any way: straight on, on a
/// curve, to and fro. What a robot at any place finds is that of the whole map.
TEST(TiledPlaneMap, TilesThatAreLoadedAheadServeEveryWay) {
  const std::vector<Eigen::Vector3f> points = hall(60.0F, 3000, 6);
  const TemporaryFolder folder;
  const auto whole = std::make_shared<const PlaneMap>(points, small_tiles());
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    const auto source = tiled(points, small_tiles(), folder, 10.0);
    for (int step = 0; step < 400; ++step) {
      const double way = 0.1 * step;
      const Eigen::Vector3d robot(way < 20.0 ? way : 20.0 + 8.0 * std::sin(way), 2.0 * std::cos(way), 0.5);
      const auto around = source->around(robot);
      for (int i = 0; i < 40; ++i) {
        const double angle = 0.157 * i;
        const Eigen::Vector3f point(static_cast<float>(robot.x() + 9.9 * std::cos(angle)),
                                    static_cast<float>(robot.y() + 9.9 * std::sin(angle)),
                                    0.05F * std::sin(static_cast<float>(robot.x() + 9.9 * std::cos(angle))));
        ASSERT_TRUE(same(around->match(point, 0.3F), whole->match(point, 0.3F))) << point.transpose();
      }
    }
    EXPECT_GT(source->loads(), 8) << threads;
  }
}

TEST(TiledPlaneMap, WhatIsHeldOutlivesTheTilesAndServesTheWindowsTail) {
  const std::vector<Eigen::Vector3f> points = hall(100.0F, 1500, 4);
  const TemporaryFolder folder;
  const auto source = tiled(points, small_tiles(), folder, 10.0);
  auto held = source->around({0, 0, 0.5});
  const Plane* plane = held->match(Eigen::Vector3f(0.4F, 0.3F, 0.02F), 0.3F);
  ASSERT_NE(plane, nullptr);
  const Plane copy = *plane;
  for (double x = 0.0; x < 60.0; x += 1.0) source->around({x, 0, 0.5});
  EXPECT_TRUE(same(plane, &copy));
  // A keyframe in an earlier place gets its earlier planes; no tile ahead is unloaded for it.
  const std::int64_t loads = source->loads();
  EXPECT_EQ(source->around({1.0, 0, 0.5}), held);
  source->around({59.0, 0, 0.5});
  EXPECT_EQ(source->loads(), loads);
  held.reset();
  source->around({1.0, 0, 0.5});
  EXPECT_EQ(source->loads(), loads + 1);
}

TEST(TiledPlaneMap, FarFromTheMapThereIsNothing) {
  const TemporaryFolder folder;
  const auto source = tiled(hall(20.0F, 1000, 5), small_tiles(), folder, 10.0);
  EXPECT_THAT(source->around({1e6, -1e6, 0})->planes(), IsEmpty());
  EXPECT_THAT(source->around({std::nan(""), 0, 0})->planes(), IsEmpty());
  EXPECT_FALSE(source->around({0, 0, 0})->planes().empty());
}

class PlaneMapLoading : public ::testing::Test {
 protected:
  void SetUp() override { write_point_cloud(folder_ / "map.pcd", hall(60.0F, 2000, 7)); }

  LoadedPlanes load(const PlaneMapOptions& options) {
    return load_planes(folder_ / "map.pcd", options, {&lidar_, 1}, folder_ / "out", warnings_);
  }

  TemporaryFolder folder_;
  LidarModel lidar_;
  WarningLog warnings_;
};

TEST_F(PlaneMapLoading, TilesALargeCloudAndLeavesNothingBehind) {
  PlaneMapOptions options = small_tiles();
  const LoadedPlanes whole = load(options);
  options.tile_above_points = 100000;
  lidar_.max_range_m = 20.0;
  const LoadedPlanes tiles = load(options);
  EXPECT_THAT(whole.description, HasSubstr("planes"));
  EXPECT_THAT(tiles.description, HasSubstr("tiles of 7 m; those within 34 m"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "out"));
  const auto a = whole.source->around({10, 0, 0});
  const auto b = tiles.source->around({10, 0, 0});
  EXPECT_NE(dynamic_cast<const TiledPlaneMap*>(tiles.source.get()), nullptr);
  for (float x = -10.0F; x < 30.0F; x += 0.03F) {
    const Eigen::Vector3f point(x, 1.0F, 0.0F);
    ASSERT_TRUE(same(a->match(point, 0.3F), b->match(point, 0.3F)));
  }
}

TEST_F(PlaneMapLoading, PointsBeyondTheVoxelsMakeNoPlanesElsewhere) {
  PlaneMapOptions options = small_tiles();
  options.voxel_m = 0.0625;
  options.margin_m = 0.02;
  options.fit.min_spread_m = 0.01;
  options.max_thickness_over_median = 0.0;
  const auto planes = [&](const std::vector<Eigen::Vector3f>& points, int tile_above_points) {
    write_point_cloud(folder_ / "map.pcd", points);
    options.tile_above_points = tile_above_points;
    std::int64_t count = 0;
    load(options).source->for_each_voxel(
        [&count](const Eigen::Vector3i&, const Plane* plane) { count += plane != nullptr; });
    return count;
  };
  std::vector<Eigen::Vector3f> points;  // a floor of 2 x 2 m
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 200; ++j) {
      points.emplace_back(0.005F + 0.01F * static_cast<float>(i), 0.005F + 0.01F * static_cast<float>(j),
                          0.03F + 0.001F * static_cast<float>((7 * i + 13 * j) % 5 - 2));
    }
  }
  const std::int64_t expected = planes(points, 1'000'000);
  EXPECT_GT(expected, 31 * 31);
  EXPECT_EQ(warnings_.count("cloud.far_points"), 0);
  // At twice the range of voxel numbers: wrapped numbers would be those of voxels beside the floor.
  for (int i = 0; i < 1000; ++i) {
    points.emplace_back(131'072.0F - 0.0625F * static_cast<float>(i % 8), 5.0F + 0.001F * static_cast<float>(i), 0.03F);
  }
  EXPECT_EQ(planes(points, 1'000'000), expected);
  EXPECT_EQ(warnings_.count("cloud.far_points"), 1000);
  EXPECT_EQ(planes(points, 1000), expected);
  std::erase_if(points, [](const Eigen::Vector3f& point) { return point.x() < 1000.0F; });
  EXPECT_THAT(message_of<InputError>([&] { planes(points, 1'000'000); }),
              HasSubstr("1000 of 1000 points are farther than 65536 m"));
}

TEST_F(PlaneMapLoading, TilesReachAsFarAsTheLidarThatSeesFarthest) {
  PlaneMapOptions options = small_tiles();
  options.tile_above_points = 100000;
  LidarModel near, far;
  near.max_range_m = far.max_range_m = 20.0;
  far.T_imu_lidar.position = {-3.6, 0.0, 4.8};
  const LidarModel both[] = {near, far};
  const LoadedPlanes tiles = load_planes(folder_ / "map.pcd", options, both, folder_ / "out", warnings_);
  EXPECT_THAT(tiles.description, HasSubstr("those within 40 m"));  // 20 + 6 m, 10 m beyond, half a tile
}

TEST_F(PlaneMapLoading, SaysWhatIsWrong) {
  PlaneMapOptions options = small_tiles();
  options.tile_above_points = 0;
  EXPECT_THAT(message_of<InputError>([&] {
                load_planes(folder_ / "map.pcd", options, {&lidar_, 1}, folder_ / "map.pcd", warnings_);
              }),
              HasSubstr("cannot create a temporary file"));
  options.tile_m = 0.1;
  EXPECT_THAT(message_of<InputError>([&] { options.check(); }), HasSubstr("tile_m: expected a number from 0.25"));
}

}  // namespace
}  // namespace lodestone
