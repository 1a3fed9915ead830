// A real pair of scans with its registration from small_gicp: planes of one scan, points of the other.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <numbers>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/condensed_cost.h"
#include "frontends/maps/point_cloud_file.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/real_data/registration.h"

namespace lodestone {
namespace {

Pose read_transform(const std::string& path) {
  std::ifstream file(path);
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) file >> matrix(row, column);
  }
  if (!file) throw std::runtime_error(path + ": not a 4 by 4 matrix");
  return {Quaternion(Matrix3(matrix.topLeftCorner<3, 3>())).normalized(), matrix.topRightCorner<3, 1>()};
}

TEST(ScanPair, CondensedRegistrationRecoversItFromIdentity) {
  LODESTONE_REAL_DATA(source_path, "lidar/source.ply");
  LODESTONE_REAL_DATA(target_path, "lidar/target.ply");
  LODESTONE_REAL_DATA(transform_path, "lidar/T_target_source.txt");
  WarningLog warnings;
  const std::vector<Eigen::Vector3f> source = read_point_cloud(source_path, warnings);
  const std::vector<Eigen::Vector3f> target = read_point_cloud(target_path, warnings);
  const Pose truth = read_transform(transform_path);
  // Voxels of a metre contain too many surfaces of this street: 21 mm.
  for (const double voxel_m : {0.5, 0.7}) {
    PlaneMapOptions map_options;
    map_options.voxel_m = voxel_m;
    const PlaneMap map(target, map_options);
    const Registration result = register_points(source, Pose{}, map, LidarModel{}, AssociationOptions{});
    const Vector6 error = result.pose.boxminus(truth);
    std::printf("voxel %.1f m: %.2f mm, %.4f deg, %d of %zu points, %d iterations\n", voxel_m,
                1e3 * error.tail<3>().norm(), error.head<3>().norm() * 180.0 / std::numbers::pi, result.cost.count,
                source.size(), result.iterations);
    EXPECT_LT(error.tail<3>().norm(), 0.02) << "voxel " << voxel_m;
    EXPECT_LT(error.head<3>().norm(), 0.3 * std::numbers::pi / 180.0) << "voxel " << voxel_m;
  }
}

}  // namespace
}  // namespace lodestone
