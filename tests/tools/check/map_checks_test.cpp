#include "tools/check/map_checks.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "core/lidar/plane_map.h"

namespace lodestone {
namespace {

/// A floor of 10 m by 10 m with this many points per square metre, `noise_m` thick, and a bush of 1 m.
std::vector<Eigen::Vector3f> floor_and_bush(int points_a_m2, double noise_m) {
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<float> place(0.0F, 10.0F);
  std::uniform_real_distribution<float> leaf(0.0F, 1.0F);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(noise_m));
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 100 * points_a_m2; ++i) {
    const float x = place(generator);
    points.emplace_back(x, place(generator), 0.125F + noise(generator));
  }
  for (int i = 0; i < 5000; ++i) {
    const float x = leaf(generator);
    const float y = leaf(generator);
    points.emplace_back(20.0F + x, y, leaf(generator));
  }
  return points;
}

TEST(CheckMap, SaysHowThickAndHowDenselyCoveredTheMapIs) {
  const PlaneMapOptions options;
  const auto map = std::make_shared<PlaneMap>(floor_and_bush(900, 0.012), options);
  const Findings found = check_map(*map, options, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, "map.planes");
  EXPECT_NE(found[0].seen.find("planes are 12 mm thick (half of them 11 to 12 mm)"), std::string::npos)
      << found[0].seen;
  const std::size_t density = found[0].seen.find("have ");
  EXPECT_NEAR(std::stod(found[0].seen.substr(density + 5)), 900.0, 30.0) << found[0].seen;
}

TEST(CheckMap, ARemedyIsForManyDoubleSurfacesOnly) {
  const PlaneMapOptions options;
  for (const float reach_m : {0.5F, 5.0F}) {  // 2.5 and 25 % of the floor
    std::vector<Eigen::Vector3f> points = floor_and_bush(900, 0.002);
    for (std::size_t i = 0; i < points.size(); i += 2) {
      if (points[i].x() < reach_m && points[i].y() < 5.0F) points[i].z() += 0.03F;
    }
    const auto map = std::make_shared<PlaneMap>(points, options);
    const Findings found = check_map(*map, options, points);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[1].kind, "map.double");
    const bool many = reach_m > 1.0F;
    EXPECT_EQ(found[1].severity, many ? Severity::warning : Severity::note) << found[1].seen;
    EXPECT_EQ(found[1].change.find("T_imu_lidar") != std::string::npos, many);
    EXPECT_EQ(found[1].change.empty(), !many);
  }
}

TEST(CheckMap, RefusesACloudWithoutPlanes) {
  const PlaneMapOptions options;
  std::vector<Eigen::Vector3f> points;  // a cable
  for (int i = 0; i < 2000; ++i)
    points.emplace_back(0.01F * static_cast<float>(i), 0.1F, 0.005F * static_cast<float>(i % 3));
  const auto map = std::make_shared<PlaneMap>(points, options);
  const Findings found = check_map(*map, options, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, "map.no_planes");
  EXPECT_EQ(found[0].severity, Severity::error);
}

}  // namespace
}  // namespace lodestone
