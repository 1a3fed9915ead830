// How thick a plane may be follows from the map: its own noise is no reason to reject a surface.
#include "core/lidar/plane_thickness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/lidar/plane_map.h"

namespace lodestone {
namespace {

using Cloud = std::vector<Eigen::Vector3f>;

/// A floor of 20 m by 20 m, 300 points a square metre, its height in the middle of voxels.
Cloud floor_of(float noise_m, std::mt19937_64& generator) {
  std::normal_distribution<float> noise(0.0F, noise_m);
  std::uniform_real_distribution<float> along(0.0F, 20.0F);
  Cloud cloud;
  cloud.reserve(120000);
  for (int i = 0; i < 120000; ++i) cloud.emplace_back(along(generator), along(generator), 0.125F + noise(generator));
  return cloud;
}

/// Flat fits with these values.
std::vector<VoxelPlane> fits(const std::vector<float>& thickness_m) {
  std::vector<VoxelPlane> voxels(thickness_m.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    voxels[i].is_flat = 1;
    voxels[i].plane.thickness = thickness_m[i];
    voxels[i].plane.count = 40;
    voxels[i].plane.minor_tilt_variance = std::pow(thickness_m[i] / 0.1F, 2.0F) / 37.0F;
  }
  return voxels;
}

PlaneThickness thickness_of_fits(const std::vector<VoxelPlane>& voxels) {
  return thickness_of([&voxels](const VoxelPlaneVisitor& visit) { std::for_each(voxels.begin(), voxels.end(), visit); },
                      PlaneMapOptions{});
}

class NoiseOfTheSurvey : public ::testing::TestWithParam<float> {};

TEST_P(NoiseOfTheSurvey, IsNoReasonToRejectAFloor) {
  std::mt19937_64 generator(1);
  const PlaneMap map(floor_of(GetParam(), generator), PlaneMapOptions{});
  // Points beyond the floor's own voxels are its tails: they are no planes.
  std::size_t planes = 0;
  for (const Plane& plane : map.planes()) planes += std::abs(plane.center.z() - 0.125F) < 0.04F ? 1 : 0;
  EXPECT_GT(static_cast<double>(planes), 0.95 * 80 * 80);
}

INSTANTIATE_TEST_SUITE_P(Metres, NoiseOfTheSurvey, ::testing::Values(0.0F, 0.005F, 0.01F, 0.02F, 0.03F, 0.035F));

TEST(PlaneLimits, ClutterIsNoNoise) {
  // Surfaces of 9 mm of noise, and as much clutter: gravel, hedges, cables.
  std::mt19937_64 generator(2);
  std::lognormal_distribution<float> surface(std::log(0.009F), 0.2F);
  std::uniform_real_distribution<float> clutter(0.01F, 0.06F);
  std::vector<float> thickness_m;
  thickness_m.reserve(20000);
  for (int i = 0; i < 20000; ++i) thickness_m.push_back(i % 2 == 0 ? surface(generator) : clutter(generator));
  const std::vector<VoxelPlane> voxels = fits(thickness_m);
  const PlaneThickness thickness = thickness_of_fits(voxels);
  EXPECT_LT(thickness.noise_limit_m, 0.02);
  const PlaneLimits limits(thickness, PlaneMapOptions{});
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const float thickness = voxels[i].plane.thickness;
    if (i % 2 == 0) EXPECT_TRUE(limits.allow(voxels[i])) << thickness;
    if (thickness > 0.03F) EXPECT_FALSE(limits.allow(voxels[i])) << thickness;
  }
}

TEST(PlaneThickness, RanksAreThoseOfTheSortedValuesInAnyOrder) {
  std::mt19937_64 generator(3);
  std::lognormal_distribution<float> distribution(std::log(0.01F), 0.3F);
  for (const int count : {1, 2, 1000, 50001}) {
    std::vector<float> values;
    values.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) values.push_back(std::min(distribution(generator), 0.03F));
    const PlaneThickness forwards = thickness_of_fits(fits(values));
    std::reverse(values.begin(), values.end());
    const PlaneThickness backwards = thickness_of_fits(fits(values));
    EXPECT_EQ(forwards.median_m, backwards.median_m);
    EXPECT_EQ(forwards.low_m, backwards.low_m);
    EXPECT_EQ(forwards.noise_limit_m, backwards.noise_limit_m);
    std::sort(values.begin(), values.end());
    EXPECT_NEAR(forwards.median_m / static_cast<double>(values[values.size() / 2]), 1.0, 0.008) << count;
  }
}

TEST(PlaneThickness, SpreadIsThatOfTheValuesWithoutChance) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> standard;
  const double chance = std::sqrt(0.5 / 37.0);  // of planes of 40 points
  for (const double spread : {0.0, 0.2, 0.4}) {
    std::vector<float> values;
    values.reserve(100000);
    for (int i = 0; i < 100000; ++i) {
      values.push_back(static_cast<float>(0.006 * std::exp(std::hypot(spread, chance) * standard(generator))));
    }
    EXPECT_NEAR(thickness_of_fits(fits(values)).log_spread(), spread, 0.03) << spread;
  }
}

TEST(PlaneThickness, OfAnEmptyMapIsZero) {
  const PlaneThickness thickness = thickness_of_fits({});
  EXPECT_EQ(thickness.median_m, 0.0);
  EXPECT_EQ(thickness.noise_limit_m, 0.0);
  EXPECT_EQ(thickness.log_spread(), 0.0);
}

}  // namespace
}  // namespace lodestone
