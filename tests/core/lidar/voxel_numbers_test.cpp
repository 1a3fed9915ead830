// Voxels have numbers up to a distance; a point beyond has no voxel, and never a voxel elsewhere.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "core/lidar/voxel_planes.h"

namespace lodestone {
namespace {

TEST(VoxelNumbers, AreThoseOfOneVoxel) {
  for (const int x : {-voxels_to_a_side, -1, 0, 7, voxels_to_a_side - 1}) {
    const Eigen::Vector3i voxel(x, -x - 1, 3);
    EXPECT_EQ(voxel_of_key(voxel_key(voxel)), voxel);
  }
}

TEST(VoxelNumbers, PointsWithoutOneAreLeftOut) {
  PlaneMapOptions options;
  options.voxel_m = 0.0625;
  options.margin_m = 0.02;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 100; ++i)
    points.emplace_back(0.006F * static_cast<float>(i % 10), 0.006F * static_cast<float>(i / 10), 0.03F);
  const auto near = fit_voxel_planes(points, options);
  ASSERT_GT(near.size(), 0U);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      for (int i = 0; i < 100; ++i) {
        Eigen::Vector3f far = points[static_cast<std::size_t>(i)];
        far[axis] += sign * 131'072.0F;  // 2^21 voxels
        points.push_back(far);
      }
    }
  }
  const auto all = fit_voxel_planes(points, options);
  ASSERT_EQ(all.size(), near.size());
  for (std::size_t i = 0; i < near.size(); ++i) {
    EXPECT_EQ(all[i].key, near[i].key);
    EXPECT_EQ(all[i].plane.count, near[i].plane.count);
  }
}

TEST(VoxelNumbers, EachVoxelHasThePointsOfItsGrownBox) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-2.0F, 2.0F);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 20'000; ++i) points.emplace_back(place(random), place(random), 0.002F * place(random));
  const PlaneMapOptions options;
  const VoxelMembership membership(options);
  std::map<std::uint64_t, int> expected;
  for (const Eigen::Vector3f& point : points) {
    const VoxelRange range = membership.of(point);
    for (int x = range.low.x(); x <= range.high.x(); ++x) {
      for (int y = range.low.y(); y <= range.high.y(); ++y) {
        for (int z = range.low.z(); z <= range.high.z(); ++z) ++expected[voxel_key({x, y, z})];
      }
    }
  }
  const std::vector<VoxelPlane> voxels = fit_voxel_planes(points, options);
  ASSERT_EQ(voxels.size(), expected.size());
  auto next = expected.begin();
  int flat = 0;
  for (const VoxelPlane& voxel : voxels) {
    EXPECT_EQ(voxel.key, next->first);  // ordered by key
    if (voxel.is_flat != 0) EXPECT_EQ(voxel.plane.count, next->second);
    flat += voxel.is_flat;
    ++next;
  }
  EXPECT_GT(flat, 200);
}

}  // namespace
}  // namespace lodestone
