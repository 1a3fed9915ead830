// Estimators on a magnetic map with few tiles in memory are bit-identical to those on the complete map.
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "core/warnings.h"
#include "estimators/factory.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone {
namespace {

struct FieldPoses final : EstimateSink {
  std::vector<Estimate> all;
  void causal(const Estimate& estimate) override { all.push_back(estimate); }
  void best(const Estimate& estimate) override { all.push_back(estimate); }
};

/// Nodes in memory, read tile by tile.
class Sampled final : public FieldNodes {
 public:
  Sampled(const FieldGrid& grid, const simulation::MagneticField& field) : grid_(grid) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Vector3 at(grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
                         grid.heights_m[0]);
        nodes.emplace_back();
        nodes.back() << field.field_ut(at).cast<float>(), 0.3F;
      }
    }
  }
  bool read(int, int row, int column, int rows, int columns, Eigen::Vector4f* result) const override {
    for (int i = 0; i < rows; ++i) {
      result =
          std::copy_n(nodes.begin() + static_cast<std::ptrdiff_t>(row + i) * grid_.columns + column, columns, result);
    }
    return true;
  }
  std::vector<Eigen::Vector4f> nodes;

 private:
  FieldGrid grid_;
};

bool same_pose(const Pose& a, const Pose& b) {
  return std::memcmp(a.position.data(), b.position.data(), sizeof(double) * 3) == 0 &&
         std::memcmp(a.rotation.coeffs().data(), b.rotation.coeffs().data(), sizeof(double) * 4) == 0;
}

class TiledField : public ::testing::TestWithParam<std::string> {};

TEST_P(TiledField, TrajectoryHasTheSameBits) {
  const simulation::World world = simulation::load_world(LODESTONE_SOURCE_DIR "/config/worlds/tunnel.yaml",
                                                         {"sensors.lidar.rows=4", "sensors.lidar.columns=16"});
  const auto environment = std::make_shared<const simulation::Environment>(world);
  simulation::SimulationSource source(world, environment, "3", simulation::SimulationSource::Drive::sequence, 3, 9.0);
  const Trajectory truth = source.trajectory();
  Vector3 low = truth.front().pose.position, high = low;
  for (const StampedPose& pose : truth) {
    low = low.cwiseMin(pose.pose.position);
    high = high.cwiseMax(pose.pose.position);
  }
  // Nodes are so close that a few metres are many tiles.
  FieldGrid grid{0.008, low.head<2>().array() - 1.5, 0, 0, {0.0}};
  grid.columns = static_cast<int>((high.x() - low.x() + 3.0) / 0.008);
  grid.rows = static_cast<int>((high.y() - low.y() + 3.0) / 0.008);
  EstimatorInput input;
  input.suite = simulation::sensor_suite(world);
  grid.heights_m = {(truth.front().pose * input.suite.magnetometers.front().T_imu_mag).position.z()};
  input.initial_pose = truth.front().pose;
  const auto nodes = std::make_shared<const Sampled>(grid, environment->field);
  WarningLog warnings;
  Synchronizer synchronizer(source, input.suite, warnings, {.lidar = false, .imu = true, .magnetometers = true});
  std::vector<ScanBundle> bundles;
  for (ScanBundle bundle; synchronizer.next(bundle);) bundles.push_back(bundle);
  ASSERT_GT(bundles.size(), 50U);

  const auto drive = [&](std::shared_ptr<const MagneticMap> map) {
    input.field = std::move(map);
    const auto estimator = make_estimator(GetParam(), input);
    FieldPoses poses;
    for (const ScanBundle& bundle : bundles) estimator->process(bundle, poses);
    estimator->finish(poses);
    return poses.all;
  };
  const auto whole = std::make_shared<const MagneticMap>(grid, nodes->nodes, 2.0);
  const auto some = std::make_shared<const MagneticMap>(grid, nodes, 2.0, 0);
  const std::vector<Estimate> expected = drive(whole);
  const std::vector<Estimate> found = drive(some);
  EXPECT_LT(some->tiles().most_resident_bytes(), whole->tiles().most_resident_bytes());
  EXPECT_GT(some->tiles().loads() * FieldTile::bytes(), some->tiles().most_resident_bytes());  // some left
  ASSERT_EQ(expected.size(), found.size());
  EXPECT_GT((expected.back().state.T_map_imu.position - expected.front().state.T_map_imu.position).norm(), 3.0);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_TRUE(same_pose(expected[i].state.T_map_imu, found[i].state.T_map_imu)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Estimators, TiledField, ::testing::Values("smoother", "ieskf"));

}  // namespace
}  // namespace lodestone
