#include "core/lidar/association.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

#include "core/lidar/plane_map.h"

namespace lodestone {
namespace {

/// A floor at z = 0 and a wall at y = 5, with points 0.1 m off either: five sigmas of the noise of 2 cm.
class RoomAssociation : public ::testing::Test {
 protected:
  RoomAssociation() {
    std::vector<Eigen::Vector3f> points;
    std::mt19937_64 generator(1);
    std::normal_distribution<float> noise(0.0F, 0.005F);
    for (float x = -6.0F; x < 6.0F; x += 0.05F) {
      for (float y = -6.0F; y < 4.6F; y += 0.05F) points.emplace_back(x, y, noise(generator));
      for (float z = 0.4F; z < 3.0F; z += 0.05F) points.emplace_back(x, 5.0F + noise(generator), z);
    }
    map_ = std::make_unique<PlaneMap>(points, PlaneMapOptions{});
    pose_.position = Vector3(0.03, 0.03, 1.03);
  }

  bool matches(const Eigen::Vector3f& point, const Vector6& sigmas) const {
    const std::vector<Eigen::Vector3f> points{point};
    const Matrix6 covariance = sigmas.array().square().matrix().asDiagonal();
    return !associate(points, pose_, covariance, *map_, LidarModel{}, AssociationOptions{}).empty();
  }

  static Vector6 sigmas(int direction, double sigma) {
    Vector6 result = Vector6::Constant(1e-4);
    result[direction] = sigma;
    return result;
  }

  const Eigen::Vector3f below_{0.1F, 0.1F, -0.93F};
  const Eigen::Vector3f ahead_{0.1F, 4.87F, 0.1F};
  std::unique_ptr<PlaneMap> map_;
  Pose pose_;
};

TEST_F(RoomAssociation, APoseThatIsKnownHasANarrowGate) {
  EXPECT_FALSE(matches(below_, sigmas(0, 1e-4)));
  EXPECT_FALSE(matches(ahead_, sigmas(0, 1e-4)));
  EXPECT_TRUE(matches(below_ - Eigen::Vector3f(0.0F, 0.0F, 0.08F), sigmas(0, 1e-4)));
  EXPECT_TRUE(matches(ahead_ + Eigen::Vector3f(0.0F, 0.08F, 0.0F), sigmas(0, 1e-4)));
}

TEST_F(RoomAssociation, WhatIsNotKnownAlongOneDirectionOpensNoGateAcrossIt) {
  EXPECT_TRUE(matches(below_, sigmas(5, 0.1)));
  EXPECT_FALSE(matches(ahead_, sigmas(5, 0.1)));
  EXPECT_TRUE(matches(ahead_, sigmas(4, 0.1)));
  EXPECT_FALSE(matches(below_, sigmas(4, 0.1)));
}

TEST_F(RoomAssociation, ATurnOpensTheGateByItsLever) {
  const Eigen::Vector3f below_at_the_side(0.1F, 4.1F, -0.93F);
  EXPECT_TRUE(matches(below_at_the_side, sigmas(0, 0.03)));   // about x, 4 m away: 12 cm
  EXPECT_FALSE(matches(below_, sigmas(0, 0.03)));             // 0.1 m away: 3 mm
  EXPECT_FALSE(matches(below_at_the_side, sigmas(1, 0.03)));  // about y
}

TEST_F(RoomAssociation, APlanesErrorCountsAsOftenAsIsStated) {
  const std::vector<Eigen::Vector3f> points{{0.1F, 0.1F, -1.02F}, {0.1F, 4.96F, 0.1F}};
  const auto matches = [&](double repeats) {
    AssociationOptions options;
    options.map_error_repeats = repeats;
    return associate(points, pose_, 1e-6 * Matrix6::Identity(), *map_, LidarModel{}, options);
  };
  const auto once = matches(1.0);
  const auto often = matches(7.0);
  ASSERT_EQ(once.size(), points.size());
  ASSERT_EQ(often.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f place = (pose_ * points[i].cast<double>()).cast<float>();
    const float by_plane = once[i].plane->variance_at(place);
    EXPECT_NEAR(often[i].variance - once[i].variance, 6.0F * by_plane, 1e-3F * by_plane);
    EXPECT_FLOAT_EQ(once[i].variance, once[i].variance_once);
    EXPECT_EQ(often[i].variance_once, once[i].variance_once);
  }
}

}  // namespace
}  // namespace lodestone
