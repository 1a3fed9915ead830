// A LiDAR drives through a room in which a person walks or stands.
#include "core/mapping/free_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace lodestone {
namespace {

const Eigen::Vector3f kLow(-5.0F, -4.0F, 0.0F), kHigh(5.0F, 4.0F, 2.5F);
constexpr double kVoxel_m = 0.05;
constexpr float kRadius_m = 0.25F, kHeight_m = 1.7F;

/// Range of a beam inside the room, m.
float range_to_room(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) {
  float range = 1e9F;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0F) continue;
    const float face = direction[axis] > 0.0F ? kHigh[axis] : kLow[axis];
    range = std::min(range, (face - origin[axis]) / direction[axis]);
  }
  return range;
}

/// Range of a beam to a person, an upright cylinder; 1e9 if there is none.
float range_to_person(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, const Eigen::Vector2f& person) {
  const Eigen::Vector2f from = origin.head<2>() - person, way = direction.head<2>();
  const float a = way.squaredNorm(), b = from.dot(way), c = from.squaredNorm() - kRadius_m * kRadius_m;
  if (b * b < a * c) return 1e9F;
  const float range = (-b - std::sqrt(b * b - a * c)) / a;
  const float height = origin.z() + range * direction.z();
  return range > 0.0F && height >= 0.0F && height <= kHeight_m ? range : 1e9F;
}

using Scans = std::vector<std::vector<LidarRay>>;

/// Forty scans of a drive along the room; `person_at(share of the drive)`.
template <class PersonAt>
Scans drive(const PersonAt& person_at) {
  constexpr int kScans = 40, kRings = 48, kColumns = 360;
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0.0F, 0.01F);
  Scans scans(kScans);
  for (int scan = 0; scan < kScans; ++scan) {
    const float share = static_cast<float>(scan) / (kScans - 1);
    const Eigen::Vector3f origin(-3.0F + 6.0F * share, -1.5F, 0.9F);
    const Eigen::Vector2f person = person_at(share);
    for (int ring = 0; ring < kRings; ++ring) {
      const float elevation = (-30.0F + 60.0F * ring / (kRings - 1)) * std::numbers::pi_v<float> / 180.0F;
      for (int column = 0; column < kColumns; ++column) {
        const float azimuth = (column + 0.37F * scan) * 2.0F * std::numbers::pi_v<float> / kColumns;
        const Eigen::Vector3f direction(std::cos(elevation) * std::cos(azimuth),
                                        std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const float range =
            std::min(range_to_room(origin, direction), range_to_person(origin, direction, person)) + noise(random);
        scans[scan].push_back({origin, origin + range * direction});
      }
    }
  }
  return scans;
}

/// Points of the map well inside the room, and near a wall, floor or ceiling.
struct Parts {
  std::size_t inside = 0;
  std::size_t surfaces = 0;
};

Parts parts_of(const std::vector<VoxelMean>& voxels) {
  constexpr float kNear_m = 0.15F;
  Parts parts;
  for (const VoxelMean& voxel : voxels) {
    const float depth = std::min((voxel.position - kLow).minCoeff(), (kHigh - voxel.position).minCoeff());
    ++(depth > kNear_m ? parts.inside : parts.surfaces);
  }
  return parts;
}

struct Result {
  std::vector<VoxelMean> all, occupied;
};

Result map_of(const Scans& scans) {
  VoxelMeans means(kVoxel_m);
  for (const auto& scan : scans) {
    for (const LidarRay& ray : scan) means.add(ray.end);
  }
  Result result{means.means(1), {}};
  FreeSpace space(result.all, kVoxel_m);
  for (const auto& scan : scans) space.add_scan(scan);
  result.occupied = space.occupied();
  return result;
}

Eigen::Vector2f walking(float share) {
  return {2.5F - 5.0F * share, 1.0F};
}

Eigen::Vector2f standing(float) {
  return {0.5F, 1.0F};
}

TEST(FreeSpace, AWalkingPersonDisappearsAndTheRoomStays) {
  const Result result = map_of(drive(walking));
  const Parts before = parts_of(result.all), after = parts_of(result.occupied);
  ASSERT_GT(before.inside, 1000U);
  EXPECT_LT(static_cast<double>(after.inside), 0.02 * static_cast<double>(before.inside));
  EXPECT_GT(static_cast<double>(after.surfaces), 0.995 * static_cast<double>(before.surfaces));
}

TEST(FreeSpace, APersonWhoStandsAllTheTimeStays) {
  Result result = map_of(drive(standing));
  // Voxels with few points are tails of the noise in front of the surface: beams pass them.
  const auto has_few_points = [](const VoxelMean& voxel) { return voxel.points < 4; };
  std::erase_if(result.all, has_few_points);
  std::erase_if(result.occupied, has_few_points);
  const Parts before = parts_of(result.all), after = parts_of(result.occupied);
  ASSERT_GT(before.inside, 400U);
  EXPECT_GT(static_cast<double>(after.inside), 0.99 * static_cast<double>(before.inside));
  EXPECT_GT(static_cast<double>(after.surfaces), 0.995 * static_cast<double>(before.surfaces));
}

TEST(FreeSpace, EarlierScansCountLikeLaterOnes) {
  Scans scans = drive(walking);
  const Result forwards = map_of(scans);
  FreeSpace space(forwards.all, kVoxel_m);
  std::reverse(scans.begin(), scans.end());
  for (const auto& scan : scans) space.add_scan(scan);
  const std::vector<VoxelMean> backwards = space.occupied();
  const auto same = [](const VoxelMean& a, const VoxelMean& b) { return a.voxel == b.voxel; };
  EXPECT_TRUE(std::equal(forwards.occupied.begin(), forwards.occupied.end(), backwards.begin(), backwards.end(), same));
}

TEST(FreeSpace, ARayThatEndsOnNoSurfaceShowsNothing) {
  VoxelMeans means(kVoxel_m);
  means.add({1.01F, 0.01F, 0.01F});
  FreeSpace space(means.means(1), kVoxel_m);
  for (int scan = 0; scan < 100; ++scan) {
    const LidarRay ray{{0.01F, 0.01F, 0.01F}, {8.0F, 0.01F, 0.01F}};
    space.add_scan({&ray, 1});
  }
  EXPECT_EQ(space.occupied().size(), 1U);
}

}  // namespace
}  // namespace lodestone
