// Estimators on a map whose tiles are loaded and unloaded are bit-identical to those on the complete map.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/lidar/plane_map.h"
#include "core/warnings.h"
#include "estimators/factory.h"
#include "frontends/maps/tiled_plane_map.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/simulate/cloud_map.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone {
namespace {

struct Poses final : EstimateSink {
  std::vector<Estimate> all;
  void causal(const Estimate& estimate) override { all.push_back(estimate); }
  void best(const Estimate& estimate) override { all.push_back(estimate); }
};

/// A few metres through the tunnel with a short LiDAR range; the map in one piece and in tiles of 2 m.
class TiledDrive : public ::testing::TestWithParam<std::tuple<std::string, bool>> {
 protected:
  static void SetUpTestSuite() {
    const simulation::World world =
        simulation::load_world(LODESTONE_SOURCE_DIR "/config/worlds/tunnel.yaml",
                               {"sensors.lidar.rows=16", "sensors.lidar.columns=128", "sensors.lidar.max_range_m=12",
                                "cloud.point_spacing_m=0.1"});
    const auto environment = std::make_shared<const simulation::Environment>(world);
    simulation::SimulationSource source(world, environment, "3", simulation::SimulationSource::Drive::sequence, 3, 9.0);
    input_ = std::make_unique<EstimatorInput>();
    input_->suite = simulation::sensor_suite(world);
    input_->initial_pose = source.trajectory().front().pose;
    const std::vector<Eigen::Vector3f> cloud = sample_cloud(world, *environment, 3);
    PlaneMapOptions options;
    options.tile_m = 2.0;
    whole_ = std::make_shared<const PlaneMap>(cloud, options);
    TiledPlaneMapBuilder builder(options, ::testing::TempDir());
    builder.add(cloud);
    tiled_ = builder.build(24.0);
    WarningLog warnings;
    Synchronizer synchronizer(source, input_->suite, warnings);
    for (ScanBundle bundle; synchronizer.next(bundle);) bundles_.push_back(bundle);
  }

  static void TearDownTestSuite() {
    input_.reset();
    whole_.reset();
    tiled_.reset();
    bundles_.clear();
  }

  std::vector<Estimate> run(std::shared_ptr<const PlaneMapSource> planes) const {
    EstimatorInput input = *input_;
    input.planes = std::move(planes);
    input.options.smoother.solver.condensed = std::get<1>(GetParam());
    const auto estimator = make_estimator(std::get<0>(GetParam()), input);
    Poses poses;
    for (const ScanBundle& bundle : bundles_) estimator->process(bundle, poses);
    estimator->finish(poses);
    return poses.all;
  }

  static inline std::unique_ptr<EstimatorInput> input_;
  static inline std::shared_ptr<const PlaneMap> whole_;
  static inline std::shared_ptr<const TiledPlaneMap> tiled_;
  static inline std::vector<ScanBundle> bundles_;
};

template <class Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

TEST_P(TiledDrive, TrajectoryHasTheSameBits) {
  const std::vector<Estimate> whole = run(whole_);
  const std::int64_t loads = tiled_->loads();
  const std::vector<Estimate> tiles = run(tiled_);
  EXPECT_GE(tiled_->loads() - loads, 4);  // one tile per metre
  EXPECT_LT(tiled_->around(input_->initial_pose.position)->planes().size(), whole_->planes().size() / 4);
  ASSERT_EQ(whole.size(), tiles.size());
  ASSERT_GT(whole.size(), 120U);
  EXPECT_GT((whole.back().state.T_map_imu.position - whole.front().state.T_map_imu.position).norm(), 4.0);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const Pose &a = whole[i].state.T_map_imu, &b = tiles[i].state.T_map_imu;
    ASSERT_GT(whole[i].diagnostics.correspondences, 100) << i;
    ASSERT_EQ(whole[i].diagnostics.correspondences, tiles[i].diagnostics.correspondences) << i;
    ASSERT_TRUE(same_bits(a.position, b.position) && same_bits(a.rotation.coeffs(), b.rotation.coeffs())) << i;
    ASSERT_TRUE(same_bits(whole[i].covariance, tiles[i].covariance)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Estimators, TiledDrive,
                         ::testing::Values(std::tuple("smoother", true), std::tuple("smoother", false),
                                           std::tuple("ieskf", true), std::tuple("lidar-inertial", true)));

}  // namespace
}  // namespace lodestone
