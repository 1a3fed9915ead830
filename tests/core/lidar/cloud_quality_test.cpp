// A cloud map's thickness, doubled surfaces, density and share on planes are those that it was made with.
#include "core/lidar/cloud_quality.h"

#include <gtest/gtest.h>

#include <random>

namespace lodestone {
namespace {

/// Horizontal patches whose points have Gaussian noise across.
class Patches {
 public:
  void add(Eigen::Vector2d low, Eigen::Vector2d size, double height_m, double sigma_m, double per_m2) {
    std::normal_distribution<double> noise(height_m, sigma_m);
    std::uniform_real_distribution<double> along(0.0, 1.0);
    const int count = static_cast<int>(size.x() * size.y() * per_m2);
    for (int i = 0; i < count; ++i) {
      const double x = low.x() + size.x() * along(random_);
      const double y = low.y() + size.y() * along(random_);
      points.push_back(Eigen::Vector3d(x, y, noise(random_)).cast<float>());
    }
  }

  std::vector<Eigen::Vector3f> points;

 private:
  std::mt19937_64 random_{7};
};

TEST(CloudQuality, HasTheThicknessDensityAndExtentThatTheMapWasMadeWith) {
  for (const double sigma_m : {0.003, 0.008, 0.015}) {
    Patches map;
    map.add({0, 0}, {20, 10}, 0.11, sigma_m, 600.0);
    const CloudQuality quality = measure_cloud(map.points, {});
    EXPECT_NEAR(quality.median_thickness_m, sigma_m, 0.05 * sigma_m);
    // Chance of some 80 points a voxel adds 8 % a standard deviation.
    EXPECT_NEAR(quality.ninetieth_thickness_m, 1.1 * sigma_m, 0.08 * sigma_m);
    EXPECT_NEAR(quality.median_points_per_m2, 600.0, 60.0);
    EXPECT_NEAR(quality.median_points_per_voxel, 600.0 * 0.25 * 0.25, 3.0);
    EXPECT_GT(quality.on_planes_share, 0.97);
    EXPECT_LT(quality.doubled_share, 0.002);
    EXPECT_NEAR(quality.high_m.x() - quality.low_m.x(), 20.0, 0.1);
    EXPECT_NEAR(quality.high_m.y() - quality.low_m.y(), 10.0, 0.1);
    EXPECT_EQ(quality.points, 120000);
  }
}

TEST(CloudQuality, TheNinetiethPercentileIsThatOfTheThickPart) {
  Patches map;
  map.add({0, 0}, {16, 10}, 0.11, 0.004, 600.0);
  map.add({16, 0}, {4, 10}, 0.11, 0.012, 600.0);
  const CloudQuality quality = measure_cloud(map.points, {});
  EXPECT_NEAR(quality.median_thickness_m, 0.0042, 0.0004);
  EXPECT_NEAR(quality.ninetieth_thickness_m, 0.012, 0.0012);
}

/// Heights place both layers in one voxel, on both sides of a face, and one in the margin alone.
TEST(CloudQuality, FindsTheShareOfTheSurfaceThatIsDoubled) {
  for (const double height_m : {0.09, 0.22, 0.24}) {
    for (const double distance_m : {0.03, 0.05}) {
      for (const double share : {0.05, 0.3}) {
        Patches map;
        map.add({0, 0}, {20, 20}, height_m, 0.005, 500.0);
        map.add({20 * (1 - share), 0}, {20 * share, 20}, height_m + distance_m, 0.005, 500.0);
        const CloudQuality quality = measure_cloud(map.points, {});
        EXPECT_NEAR(quality.doubled_share, share, 0.1 * share + 0.01) << height_m << " " << distance_m;
        EXPECT_NEAR(quality.doubled_distance_m, distance_m, 0.003);
        EXPECT_NEAR(quality.median_thickness_m, 0.005, 0.0004);
        EXPECT_GT(quality.doubled_place_m.x(), 20.0F * static_cast<float>(1 - share) - 0.3F);
      }
    }
  }
}

TEST(CloudQuality, StepsCornersAndSurfacesFurtherApartAreNotDoubled) {
  Patches steps;
  for (int i = 0; i < 20; ++i) steps.add({0.4 * i, 0}, {0.4, 10}, 0.1 + 0.05 * i, 0.005, 600.0);
  EXPECT_LT(measure_cloud(steps.points, {}).doubled_share, 0.02);

  Patches corner;
  corner.add({0, 0}, {10, 10}, 0.1, 0.005, 600.0);
  const std::size_t floor = corner.points.size();
  corner.add({0, 0}, {10, 10}, 0.1, 0.005, 600.0);
  for (std::size_t i = floor; i < corner.points.size(); ++i) std::swap(corner.points[i].x(), corner.points[i].z());
  EXPECT_LT(measure_cloud(corner.points, {}).doubled_share, 0.01);

  Patches apart;
  apart.add({0, 0}, {10, 10}, 0.05, 0.005, 600.0);
  apart.add({0, 0}, {10, 10}, 0.25, 0.005, 600.0);
  EXPECT_LT(measure_cloud(apart.points, {}).doubled_share, 0.01);
}

TEST(CloudQuality, PointsOfABushAreOnNoPlane) {
  Patches map;
  map.add({0, 0}, {10, 10}, 0.11, 0.005, 600.0);
  const std::size_t flat = map.points.size();
  map.add({20, 0}, {5, 5}, 1.0, 0.3, 2400.0);
  const CloudQuality quality = measure_cloud(map.points, {});
  EXPECT_NEAR(quality.on_planes_share, static_cast<double>(flat) / static_cast<double>(map.points.size()), 0.03);
}

TEST(CloudQuality, OfNoPointsIsNothing) {
  const CloudQuality quality = measure_cloud({}, {});
  EXPECT_EQ(quality.voxels, 0);
  EXPECT_EQ(quality.on_planes_share, 0.0);
}

}  // namespace
}  // namespace lodestone
