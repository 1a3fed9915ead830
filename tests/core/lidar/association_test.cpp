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

TEST_F(RoomAssociation, APlanesErrorCountsAsOftenAsScansAreAveragedAlongItsNormal) {
  const auto variance = [&](const Eigen::Vector3f& point, const ScanAveraging& averaging) {
    const std::vector<Eigen::Vector3f> points{point};
    const auto matches =
        associate(points, pose_, 1e-6 * Matrix6::Identity(), *map_, LidarModel{}, AssociationOptions{}, {}, averaging);
    EXPECT_EQ(matches.size(), 1U);
    return matches.empty()
               ? std::pair(0.0, 0.0)
               : std::pair(
                     static_cast<double>(matches[0].variance),
                     static_cast<double>(matches[0].plane->variance_at((pose_ * point.cast<double>()).cast<float>())));
  };
  const Eigen::Vector3f floor(0.1F, 0.1F, -1.02F);
  const Eigen::Vector3f wall(0.1F, 4.96F, 0.1F);
  const Vector6 known = Vector6::Constant(1e-6);
  const auto averaging = [&](double y_scans, double z_scans) {
    Vector6 information = known.cwiseInverse();
    information[4] /= y_scans;
    information[5] /= z_scans;
    return ScanAveraging{information.asDiagonal(), known.asDiagonal()};
  };
  const double most_repeats = AssociationOptions{}.map_error_repeats;  // if the averaging is unknown
  const auto repeats = [&](const Eigen::Vector3f& point, const ScanAveraging& scans) {
    const double whole = variance(point, {}).first;
    const auto [with, own] = variance(point, scans);
    return most_repeats - (whole - with) / own;
  };
  EXPECT_NEAR(repeats(floor, averaging(1.0, 5.0)), 5.0, 0.2);
  EXPECT_NEAR(repeats(wall, averaging(6.0, 1.0)), 6.0, 0.2);
  EXPECT_NEAR(repeats(floor, averaging(6.0, 1.0)), 2.0, 0.2);  // at least two repeats
  EXPECT_NEAR(repeats(floor, averaging(1.0, 1e12)), most_repeats, 0.2);
  EXPECT_NEAR(repeats(wall, averaging(1.0, 1e12)), 2.0, 0.2);  // an unobserved direction does not affect the others
  // Within their limits, however uncertain a tunnel's axis is compared with the directions across (here 5 m against 10
  // um), and for any direction of the axis.
  ScanAveraging tunnel = averaging(5.0, 5.0);
  const Vector3 axis = Vector3(0.6, 0.64, 0.48).normalized();
  tunnel.covariance = 1e-10 * Matrix6::Identity();
  tunnel.covariance.bottomRightCorner<3, 3>() += 25.0 * axis * axis.transpose();
  tunnel.information_of_scan = 2e9 * Matrix6::Identity();
  tunnel.information_of_scan.bottomRightCorner<3, 3>() -= 2e9 * axis * axis.transpose();
  for (const Eigen::Vector3f& point : {floor, wall}) {
    EXPECT_GT(repeats(point, tunnel), 2.0 - 0.2);
    EXPECT_LT(repeats(point, tunnel), most_repeats + 0.2);
  }
}

}  // namespace
}  // namespace lodestone
