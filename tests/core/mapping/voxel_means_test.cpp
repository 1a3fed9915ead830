#include "core/mapping/voxel_means.h"

#include <gtest/gtest.h>

#include <random>

#include "core/lidar/voxel_planes.h"

namespace lodestone {
namespace {

TEST(VoxelMeans, AreTheMeansOfThePointsInEachVoxel) {
  VoxelMeans means(0.5);
  for (const Eigen::Vector3f& point :
       {Eigen::Vector3f(0.1F, 0.1F, 0.1F), Eigen::Vector3f(-0.1F, 0.1F, 0.1F), Eigen::Vector3f(0.3F, 0.1F, 0.4F)}) {
    means.add(point);
  }
  const std::vector<VoxelMean> all = means.means(1);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].voxel, voxel_key({-1, 0, 0}));
  EXPECT_EQ(all[0].points, 1U);
  EXPECT_LT((all[0].position - Eigen::Vector3f(-0.1F, 0.1F, 0.1F)).norm(), 1e-6F);
  EXPECT_EQ(all[1].points, 2U);
  EXPECT_LT((all[1].position - Eigen::Vector3f(0.2F, 0.1F, 0.25F)).norm(), 1e-6F);
  ASSERT_EQ(means.means(2).size(), 1U) << "a voxel with one point of two";
}

TEST(VoxelMeans, AreExactFarFromTheOriginAfterManyPoints) {
  const Eigen::Vector3f corner(1000.0F, -2000.0F, 50.0F);
  VoxelMeans means(0.0625);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> offset(0.0F, 0.0624F);
  Vector3 sum = Vector3::Zero();
  constexpr int kPoints = 200'000;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3f point = corner + Eigen::Vector3f(offset(random), offset(random), offset(random));
    sum += point.cast<double>();
    means.add(point);
  }
  EXPECT_EQ(means.size(), 1U);
  EXPECT_LT((means.means(1).at(0).position.cast<double>() - sum / kPoints).norm(), 2e-4) << "steps of floats at 2 km";
}

TEST(VoxelMeans, IgnorePointsWithoutAVoxel) {
  VoxelMeans means(0.01);
  means.add({20'000.0F, 0.0F, 0.0F});
  means.add({std::nanf(""), 0.0F, 0.0F});
  EXPECT_EQ(means.size(), 0U);
}

}  // namespace
}  // namespace lodestone
