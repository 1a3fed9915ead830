#include "core/lidar/double_surfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace lodestone {
namespace {

using Cloud = std::vector<Eigen::Vector3f>;

/// A wall of 20 m by 4 m, 1000 points a square metre, rotated against the axes. The last share of the wall is there
/// twice.
Cloud wall(double noise_m, double twice_share, double distance_m, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, noise_m);
  const Quaternion turned = so3::exp(Vector3(0.0, 0.3, 0.4));
  Cloud points;
  for (int i = 0; i < 80000; ++i) {
    const double along = 20.0 * unit(generator);
    const double up = 4.0 * unit(generator);
    const bool twice = along > 20.0 * (1.0 - twice_share) && unit(generator) < 0.5;
    points.push_back((turned * Vector3(noise(generator) + (twice ? distance_m : 0.0), along, up)).cast<float>());
  }
  return points;
}

TEST(DoubleSurfaces, AreFoundWhereTheyAreAndHowFarApart) {
  const DoubleSurfaces found = find_double_surfaces(wall(0.006, 0.25, 0.03, 1), 0.25);
  EXPECT_GT(found.looked_at, 1000U);
  // Some of the voxels with two surfaces contain an edge, or few points of one surface.
  EXPECT_NEAR(found.share(), 0.25, 0.06);
  EXPECT_NEAR(found.distance_m, 0.03, 0.002);
}

TEST(DoubleSurfaces, AreNotSeenInOneNoisySurface) {
  for (const double noise_m : {0.002, 0.01, 0.03}) {
    EXPECT_EQ(find_double_surfaces(wall(noise_m, 0.0, 0.0, 2), 0.25).found, 0U) << noise_m;
  }
}

TEST(DoubleSurfaces, AreNotSeenInStepsAndCorners) {
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.005);
  Cloud points;
  for (int i = 0; i < 80000; ++i) {
    const double x = 20.0 * unit(generator);
    const double y = 4.0 * unit(generator) - 2.0;
    if (i % 4 == 0) {
      points.push_back(Vector3(x, 2.0 + noise(generator), 2.0 * unit(generator)).cast<float>());  // a wall
    } else {
      points.push_back(Vector3(x, y, (y > 0.1 ? 0.12 : 0.0) + noise(generator)).cast<float>());  // a kerb
    }
  }
  const DoubleSurfaces found = find_double_surfaces(points, 0.25);
  EXPECT_LT(found.share(), 0.005);
}

TEST(DoubleSurfaces, DoNotDependOnTheOrderOfPoints) {
  Cloud points = wall(0.006, 0.25, 0.03, 4);
  const DoubleSurfaces first = find_double_surfaces(points, 0.25);
  std::shuffle(points.begin(), points.end(), std::mt19937_64(5));
  const DoubleSurfaces second = find_double_surfaces(points, 0.25);
  EXPECT_EQ(first.found, second.found);
  EXPECT_EQ(first.distance_m, second.distance_m);
}

}  // namespace
}  // namespace lodestone
