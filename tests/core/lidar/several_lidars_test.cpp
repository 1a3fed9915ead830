#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/lidar_correction.h"

namespace lodestone {
namespace {

constexpr std::size_t points_of_a_lidar = 4000;

double square(double value) {
  return value * value;
}

/// A floor and a wall, measured by two LiDARs: the second is 3 m behind the first and has ten times its noise.
class TwoLidarsInARoom : public ::testing::Test {
 protected:
  TwoLidarsInARoom() : lidars_(2) {
    std::vector<Eigen::Vector3f> points;
    std::normal_distribution<float> noise(0.0F, 0.002F);
    for (float x = -8.0F; x < 8.0F; x += 0.05F) {
      for (float y = -6.0F; y < 4.6F; y += 0.05F) points.emplace_back(x, y, noise(random_));
      for (float z = 0.4F; z < 3.0F; z += 0.05F) points.emplace_back(x, 5.0F + noise(random_), z);
    }
    map_ = std::make_unique<PlaneMap>(points, PlaneMapOptions{});
    pose_ = {so3::exp(Vector3(0.02, -0.03, 0.8)), Vector3(1.53, 0.03, 1.03)};
    lidars_[0].T_imu_lidar = {so3::exp(Vector3(0.1, 0.2, 0.3)), Vector3(0.2, 0.0, 0.3)};
    lidars_[1].T_imu_lidar = {so3::exp(Vector3(0.0, -0.1, 3.0)), Vector3(-2.8, 0.0, 0.3)};
    lidars_[0].range_noise_m = 0.006;
    lidars_[0].direction_noise_rad = 4e-4;
    lidars_[1].range_noise_m = 0.06;
    lidars_[1].direction_noise_rad = 4e-3;
  }

  /// Points of both LiDARs, alternating, on floor and wall, with their noise; imu frame.
  std::vector<LidarPoint> measured() {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::normal_distribution<double> normal;
    std::vector<LidarPoint> result;
    for (std::size_t i = 0; i < 2 * points_of_a_lidar; ++i) {
      const LidarModel& lidar = lidars_[i % 2];
      const double bump = AssociationOptions{}.surface_roughness_m * normal(random_);
      const Vector3 place = i % 4 < 2
                                ? Vector3(-6.0 + 12.0 * uniform(random_), -5.0 + 9.0 * uniform(random_), bump)
                                : Vector3(-6.0 + 12.0 * uniform(random_), 5.0 + bump, 0.7 + 2.0 * uniform(random_));
      const Vector3 beam = pose_.inverse() * place - lidar.T_imu_lidar.position;
      const Vector3 direction = beam.normalized();
      const Vector3 side = direction.unitOrthogonal();
      const Vector3 turned =
          direction + lidar.direction_noise_rad * (normal(random_) * side + normal(random_) * direction.cross(side));
      LidarPoint point;
      point.position =
          (lidar.T_imu_lidar.position + (beam.norm() + lidar.range_noise_m * normal(random_)) * turned.normalized())
              .cast<float>();
      point.lidar = static_cast<std::uint8_t>(i % 2);
      result.push_back(point);
    }
    return result;
  }

  std::vector<Correspondence> associated(const std::vector<LidarPoint>& measured, const ScanLidars& lidars) const {
    std::vector<Eigen::Vector3f> points;
    for (const LidarPoint& point : measured) points.push_back(point.position);
    AssociationOptions options;
    options.max_distance_m = 10.0;
    options.map_error_repeats = 3.0;
    const Matrix6 anywhere = 1e6 * Matrix6::Identity();  // no gate: all are matched
    return associate(points, pose_, anywhere, *map_, lidars, options);
  }

  std::mt19937_64 random_{3};
  std::unique_ptr<PlaneMap> map_;
  Pose pose_;
  std::vector<LidarModel> lidars_;
};

TEST_F(TwoLidarsInARoom, EachPointsVarianceIsThatOfItsOwnLidar) {
  const std::vector<LidarPoint> points = measured();
  const std::vector<Correspondence> matches = associated(points, ScanLidars(lidars_, points));
  ASSERT_GT(matches.size(), points.size() / 2);
  std::size_t next = 0;
  std::array<int, 2> compared{};
  for (const Correspondence& match : matches) {
    while (points[next].position != match.point) ++next;
    const LidarModel& own = lidars_[points[next].lidar];
    const Vector3 beam = pose_.rotation * (match.point.cast<double>() - own.T_imu_lidar.position);
    const double cosine = match.plane->normal.cast<double>().dot(beam.normalized());
    const double by_sensor = square(own.range_noise_m * cosine) +
                             square(own.direction_noise_rad * beam.norm()) * (1.0 - square(cosine)) +
                             square(AssociationOptions{}.surface_roughness_m);
    const Eigen::Vector3f place = (pose_ * match.point.cast<double>()).cast<float>();
    const auto by_plane = static_cast<double>(match.plane->variance_at(place));
    ASSERT_NEAR(match.variance_once, by_sensor + by_plane, 1e-4 * (by_sensor + by_plane));
    ASSERT_NEAR(match.variance, by_sensor + 3.0 * by_plane, 1e-4 * (by_sensor + 3.0 * by_plane));
    ++compared[points[next].lidar];
  }
  EXPECT_GT(compared[0], 1000);
  EXPECT_GT(compared[1], 1000);
}

/// Residuals of either LiDAR have the assumed variance: χ²/n of n > 1000 is within 15 % of 1.
TEST_F(TwoLidarsInARoom, ResidualsOfEitherLidarAreAsLargeAsAssumed) {
  const std::vector<LidarPoint> all = measured();
  for (const int lidar : {0, 1}) {
    std::vector<LidarPoint> points = all;
    std::erase_if(points, [lidar](const LidarPoint& point) { return point.lidar != lidar; });
    const auto matches = associated(points, ScanLidars(lidars_, points));
    ASSERT_GT(matches.size(), 1000U);
    EXPECT_NEAR(normalized_residuals(matches, pose_), 1.0, 0.15) << lidar;
  }
  // As if the first LiDAR had measured the second's points.
  std::vector<LidarPoint> second = all;
  std::erase_if(second, [](const LidarPoint& point) { return point.lidar == 0; });
  EXPECT_GT(normalized_residuals(associated(second, lidars_[0]), pose_), 10.0);
}

TEST_F(TwoLidarsInARoom, PointsOfOneLidarHaveTheSameBitsAloneAndAmongOthers) {
  const std::vector<LidarPoint> all = measured();
  std::vector<LidarPoint> first = all;
  std::erase_if(first, [](const LidarPoint& point) { return point.lidar != 0; });
  const auto alone = associated(first, lidars_[0]);
  const auto among = associated(all, ScanLidars(lidars_, all));
  std::size_t next = 0;
  for (const Correspondence& match : alone) {
    while (among.at(next).point != match.point) ++next;
    ASSERT_EQ(match.plane, among[next].plane);
    ASSERT_EQ(match.variance, among[next].variance);
    ASSERT_EQ(match.variance_once, among[next].variance_once);
    ASSERT_EQ(match.robust_weight, among[next].robust_weight);
  }
}

TEST_F(TwoLidarsInARoom, ThePointsLidarsAreThoseOfTheSuite) {
  std::vector<LidarPoint> points = measured();
  EXPECT_TRUE(ScanLidars({LidarModel{}}, {}).of_points.empty());
  EXPECT_THROW(ScanLidars({LidarModel{}}, points), std::invalid_argument);
  ScanLidars lidars(lidars_, points);
  points.pop_back();
  EXPECT_THROW(associated(points, lidars), std::invalid_argument);
}

TEST(LidarCorrection, FurtherLidarsMoveRigidlyWithTheFirst) {
  SensorSuite suite;
  suite.lidar.T_imu_lidar = {so3::exp(Vector3(0.1, 0.2, 0.3)), Vector3(0.2, 0.0, 0.3)};
  suite.further_lidars = {suite.lidar, suite.lidar};
  suite.further_lidars[0].T_imu_lidar = {so3::exp(Vector3(0.0, -0.1, 3.0)), Vector3(-2.8, 0.0, 0.3)};
  suite.further_lidars[1].range_noise_m = 0.7;
  const LidarCorrection correction{{0.05, -0.04, 0.06}, {0.02, -0.03, 0.01}, 0.003};
  const std::vector<LidarModel> given = suite.lidars();
  const std::vector<LidarModel> found = correction.corrected(given);
  ASSERT_EQ(found.size(), 3U);
  const Pose& first = suite.lidar.T_imu_lidar;
  EXPECT_LT(found[0].T_imu_lidar.boxminus(correction.corrected(first)).norm(), 1e-15);
  for (std::size_t i = 0; i < 3; ++i) {
    const Pose before = first.inverse() * given[i].T_imu_lidar;
    const Pose after = found[0].T_imu_lidar.inverse() * found[i].T_imu_lidar;
    EXPECT_LT(after.boxminus(before).norm(), 1e-12) << i;
    EXPECT_EQ(found[i].range_noise_m, given[i].range_noise_m);
  }
}

}  // namespace
}  // namespace lodestone
