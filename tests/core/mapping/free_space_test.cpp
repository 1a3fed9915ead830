// A LiDAR drives through a room in which a person walks or stands.
#include "core/mapping/free_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace lodestone {
namespace {

const Eigen::Vector3f kRoomLow(-5.0F, -4.0F, 0.0F), kRoomHigh(5.0F, 4.0F, 2.5F);
constexpr double kMapVoxel_m = 0.05;
constexpr float kPersonRadius_m = 0.25F, kPersonHeight_m = 1.7F;

/// Range of a beam inside the room, m.
float range_to_room(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) {
  float range = 1e9F;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0F) continue;
    const float face = direction[axis] > 0.0F ? kRoomHigh[axis] : kRoomLow[axis];
    range = std::min(range, (face - origin[axis]) / direction[axis]);
  }
  return range;
}

/// Range of a beam to a person, an upright cylinder; 1e9 if there is none.
float range_to_person(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, const Eigen::Vector2f& person) {
  const Eigen::Vector2f from = origin.head<2>() - person, way = direction.head<2>();
  const float a = way.squaredNorm(), b = from.dot(way), c = from.squaredNorm() - kPersonRadius_m * kPersonRadius_m;
  if (b * b < a * c) return 1e9F;
  const float range = (-b - std::sqrt(b * b - a * c)) / a;
  const float height = origin.z() + range * direction.z();
  return range > 0.0F && height >= 0.0F && height <= kPersonHeight_m ? range : 1e9F;
}

using RoomScans = std::vector<std::vector<LidarRay>>;

/// Forty scans of a drive along the room; `person_at(share of the drive)`.
template <class PersonAt>
RoomScans drive_with_person(const PersonAt& person_at) {
  constexpr int kScans = 40, kRings = 48, kColumns = 360;
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0.0F, 0.01F);
  RoomScans scans(kScans);
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
struct RoomParts {
  std::size_t inside = 0;
  std::size_t surfaces = 0;
};

RoomParts room_parts_of(const std::vector<VoxelMean>& voxels) {
  constexpr float kNear_m = 0.15F;
  RoomParts parts;
  for (const VoxelMean& voxel : voxels) {
    const float depth = std::min((voxel.position - kRoomLow).minCoeff(), (kRoomHigh - voxel.position).minCoeff());
    ++(depth > kNear_m ? parts.inside : parts.surfaces);
  }
  return parts;
}

struct RoomMap {
  std::vector<VoxelMean> all, occupied;
};

RoomMap room_map_of(const RoomScans& scans) {
  VoxelMeans means(kMapVoxel_m);
  for (const auto& scan : scans) {
    for (const LidarRay& ray : scan) means.add(ray.end);
  }
  RoomMap result{means.means(1), {}};
  FreeSpace space(result.all, kMapVoxel_m);
  for (const auto& scan : scans) space.add_scan(scan);
  result.occupied = space.occupied();
  return result;
}

Eigen::Vector2f walking_person(float share) {
  return {2.5F - 5.0F * share, 1.0F};
}

Eigen::Vector2f standing_person(float) {
  return {0.5F, 1.0F};
}

TEST(FreeSpace, AWalkingPersonDisappearsAndTheRoomStays) {
  const RoomMap result = room_map_of(drive_with_person(walking_person));
  const RoomParts before = room_parts_of(result.all), after = room_parts_of(result.occupied);
  ASSERT_GT(before.inside, 1000U);
  EXPECT_LT(static_cast<double>(after.inside), 0.02 * static_cast<double>(before.inside));
  EXPECT_GT(static_cast<double>(after.surfaces), 0.995 * static_cast<double>(before.surfaces));
}

TEST(FreeSpace, APersonWhoStandsAllTheTimeStays) {
  RoomMap result = room_map_of(drive_with_person(standing_person));
  // Voxels with few points are tails of the noise in front of the surface: beams pass them.
  const auto has_few_points = [](const VoxelMean& voxel) { return voxel.points < 4; };
  std::erase_if(result.all, has_few_points);
  std::erase_if(result.occupied, has_few_points);
  const RoomParts before = room_parts_of(result.all), after = room_parts_of(result.occupied);
  ASSERT_GT(before.inside, 400U);
  EXPECT_GT(static_cast<double>(after.inside), 0.99 * static_cast<double>(before.inside));
  EXPECT_GT(static_cast<double>(after.surfaces), 0.995 * static_cast<double>(before.surfaces));
}

TEST(FreeSpace, EarlierScansCountLikeLaterOnes) {
  RoomScans scans = drive_with_person(walking_person);
  const RoomMap forwards = room_map_of(scans);
  FreeSpace space(forwards.all, kMapVoxel_m);
  std::reverse(scans.begin(), scans.end());
  for (const auto& scan : scans) space.add_scan(scan);
  const std::vector<VoxelMean> backwards = space.occupied();
  const auto same = [](const VoxelMean& a, const VoxelMean& b) { return a.voxel == b.voxel; };
  EXPECT_TRUE(std::equal(forwards.occupied.begin(), forwards.occupied.end(), backwards.begin(), backwards.end(), same));
}

TEST(FreeSpace, ARayThatEndsOnNoSurfaceShowsNothing) {
  VoxelMeans means(kMapVoxel_m);
  means.add({1.01F, 0.01F, 0.01F});
  FreeSpace space(means.means(1), kMapVoxel_m);
  for (int scan = 0; scan < 100; ++scan) {
    const LidarRay ray{{0.01F, 0.01F, 0.01F}, {8.0F, 0.01F, 0.01F}};
    space.add_scan({&ray, 1});
  }
  EXPECT_EQ(space.occupied().size(), 1U);
}

}  // namespace
}  // namespace lodestone
