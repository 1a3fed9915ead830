// A map's planes lie where its surfaces are, for the points that are matched to them.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "core/lidar/plane_map.h"

namespace lodestone {
namespace {

using Cloud = std::vector<Eigen::Vector3f>;

/// Mean signed distance, along `outward`, of the points with a plane, and their number.
struct Matched {
  double mean_m = 0.0;
  int count = 0;
};

template <class Outward>
Matched match_all(const PlaneMap& map, const Cloud& points, Outward outward) {
  Matched result;
  for (const Eigen::Vector3f& point : points) {
    const Plane* plane = map.match(point, 0.1F);
    if (plane == nullptr) continue;
    const double side = plane->normal.dot(outward(point)) > 0.0F ? 1.0 : -1.0;
    result.mean_m += side * plane->distance(point);
    ++result.count;
  }
  result.mean_m /= std::max(result.count, 1);
  return result;
}

/// Square pillars of 1.5 m whose faces lie in faces of voxels, with their noise.
Cloud pillars(double spacing_m, double noise_m, bool front_alone, std::mt19937_64& generator) {
  std::normal_distribution<double> noise(0.0, noise_m);
  std::uniform_real_distribution<double> along(-0.75, 0.75);
  Cloud cloud;
  const auto per_face = static_cast<int>(1.5 * 3.0 / (spacing_m * spacing_m));
  for (int pillar = 0; pillar < 12; ++pillar) {
    const double x = 3.0 + 7.0 * pillar;
    for (int i = 0; i < per_face; ++i) {
      const double z = 0.5 + 2.0 * (along(generator) + 0.75);
      cloud.emplace_back(x + along(generator), 12.75 + noise(generator), z);
      if (front_alone) continue;
      cloud.emplace_back(x - 0.75 + noise(generator), 13.5 + along(generator), z);
      cloud.emplace_back(x + 0.75 + noise(generator), 13.5 + along(generator), z);
    }
  }
  return cloud;
}

TEST(PlaneMap, CornersDoNotLetWallsSeemNearer) {
  std::mt19937_64 generator(1);
  const PlaneMap map(pillars(0.08, 0.01, false, generator), PlaneMapOptions{});
  const Cloud scan = pillars(0.02, 0.02, true, generator);
  const Matched found = match_all(map, scan, [](const Eigen::Vector3f&) { return Eigen::Vector3f(0.0F, -1.0F, 0.0F); });
  // Each plane is off by some millimetres, but their mean is not. At the corners, a third of the face, matching only
  // points in front would give 16 mm.
  ASSERT_GT(found.count, 500);
  EXPECT_LT(std::abs(found.mean_m), 0.002);
}

TEST(PlaneMap, ASmoothWallKeepsItsPoints) {
  std::mt19937_64 generator(2);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::uniform_real_distribution<double> along(0.0, 10.0);
  Cloud wall;
  Cloud scan;
  for (int i = 0; i < 60000; ++i) wall.emplace_back(along(generator), 5.0 + noise(generator), along(generator));
  for (int i = 0; i < 2000; ++i)
    scan.emplace_back(0.5 + 0.9 * along(generator), 5.0 + 2.0 * noise(generator), 0.5 + 0.9 * along(generator));
  const PlaneMap map(wall, PlaneMapOptions{});
  const Matched found = match_all(map, scan, [](const Eigen::Vector3f&) { return Eigen::Vector3f(0.0F, -1.0F, 0.0F); });
  EXPECT_GT(found.count, 1950);
  EXPECT_LT(std::abs(found.mean_m), 0.002);
}

TEST(PlaneMap, PlanesOfACurvedWallStandWhereItsPointsDo) {
  constexpr double kRadius_m = 3.0;
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * std::numbers::pi);
  std::uniform_real_distribution<double> height(0.0, 5.0);
  const auto vault = [&](int count) {
    Cloud cloud;
    for (int i = 0; i < count; ++i) {
      const double a = angle(generator);
      cloud.emplace_back(kRadius_m * std::cos(a), kRadius_m * std::sin(a), height(generator));
    }
    return cloud;
  };
  const Cloud surface = vault(400000);
  const Cloud scan = vault(50000);
  const auto inwards = [](const Eigen::Vector3f& point) {
    return Eigen::Vector3f(-point.x(), -point.y(), 0.0F).normalized();
  };
  const Matched within = match_all(PlaneMap(surface, PlaneMapOptions{}), scan, inwards);
  ASSERT_GT(within.count, 30000);
  // A chord over the voxel and its margin lies further inside, by (0.37² − 0.25²) / 24 r, if the wall runs along an
  // axis.
  constexpr double kChordWithMargin_m = (0.37 * 0.37 - 0.25 * 0.25) / (24.0 * kRadius_m);
  EXPECT_LT(std::abs(within.mean_m), 0.25 * kChordWithMargin_m);
}

/// Mean of the true height's square over a variance.
struct SquaredErrors {
  double over_map = 0.0;  ///< that of the map's planes
  double over_own = 0.0;  ///< that from each plane's own points alone
};

/// Of a floor of planes with few points.
SquaredErrors squared_errors_of_a_floor() {
  std::mt19937_64 generator(5);
  std::normal_distribution<float> noise(0.0F, 0.01F);
  std::uniform_real_distribution<float> along(0.0F, 40.0F);
  Cloud cloud;
  for (int i = 0; i < 200000; ++i) cloud.emplace_back(along(generator), along(generator), 0.125F + noise(generator));
  const PlaneMapOptions options;
  const PlaneMap map(cloud, options);
  std::map<std::uint64_t, Plane> own;
  for (const VoxelPlane& voxel : fit_voxel_planes(cloud, options)) own[voxel.key] = voxel.plane;
  SquaredErrors result;
  int count = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f point(along(generator), along(generator), 0.125F);
    const Plane* plane = map.match(point, 0.1F);
    if (plane == nullptr) continue;
    const auto inverse_voxel = static_cast<float>(1.0 / options.voxel_m);
    const auto alone = own.find(voxel_key(voxel_of(plane->center, inverse_voxel)));
    if (alone == own.end() || alone->second.center != plane->center) continue;
    const double squared_m2 = std::pow(static_cast<double>(plane->distance(point)), 2);
    result.over_map += squared_m2 / static_cast<double>(plane->variance_at(point));
    result.over_own += squared_m2 / static_cast<double>(alone->second.variance_at(point));
    ++count;
  }
  EXPECT_GT(count, 10000);
  result.over_map /= count;
  result.over_own /= count;
  return result;
}

TEST(PlaneMap, PlanesOfFewPointsKnowTheirErrorFromAllOfThem) {
  const SquaredErrors errors = squared_errors_of_a_floor();
  EXPECT_NEAR(errors.over_map, 1.0, 0.1);
  EXPECT_GT(errors.over_own, 1.1);
}

}  // namespace
}  // namespace lodestone
