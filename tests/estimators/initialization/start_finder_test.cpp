// Initial pose anywhere on the map: in a room that looks the same from both ends, and at random places of a shipped
// world.
#include "estimators/initialization/start_finder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "core/error.h"
#include "frontends/maps/tiled_plane_map.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/simulate/cloud_map.h"
#include "tools/simulate/random_starts.h"

namespace lodestone {
namespace {

/// Empty except for four equal pillars: after half a turn the room looks the same, but the steel in its floor differs.
constexpr const char* kRoom = R"(
name: room
steel_seed: 3
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 16, columns: 512}
  magnetometer_mounts:
    - {position_m: [0.3, 0.25, -0.08]}
    - {position_m: [0.3, -0.25, -0.08]}
    - {position_m: [-0.3, 0.25, -0.08]}
    - {position_m: [-0.3, -0.25, -0.08]}
solids:
  - {name: floor, shape: rectangle, size_m: [16, 10], steel: [{kind: rods, from_m: [-8, -5, -0.6], to_m: [8, 5, -0.4],
     density_per_m2: 1.5, length_m: [0.5, 1.5], moment_sigma_a_m2: 45}]}
  - {name: room, shape: box, at_m: [0, 0, 2], size_m: [16, 10, 4]}
  - {name: pillars, shape: box, at_m: [-4, -2, 2], size_m: [0.6, 0.6, 4], repeat: {count: [2, 2, 1], step_m: [8, 4, 0]}}
cloud: {point_spacing_m: 0.08}
sequences:
  loop: {waypoints_m: [[-6, -3.5], [6, -3.5], [6, 3.5], [-6, 3.5]], speed: [[0, 1.0]]}
)";

std::shared_ptr<const MagneticMap> true_field(const simulation::World& world,
                                              const simulation::Environment& environment, const Eigen::Vector2d& low,
                                              const Eigen::Vector2d& high) {
  FieldGrid grid;
  grid.resolution_m = 0.15;
  grid.origin = low;
  grid.columns = static_cast<int>((high.x() - low.x()) / grid.resolution_m) + 1;
  grid.rows = static_cast<int>((high.y() - low.y()) / grid.resolution_m) + 1;
  grid.heights_m = {world.imu.height_m + world.magnetometers.mounts.front().T_imu_mag().position.z()};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector3 field = environment.field.field_ut(
          Vector3(low.x() + grid.resolution_m * column, low.y() + grid.resolution_m * row, grid.heights_m.front()));
      nodes.emplace_back(field.x(), field.y(), field.z(), 0.3F);
    }
  }
  return std::make_shared<MagneticMap>(grid, nodes, 3.0);
}

/// The beginning of a log, with its true pose.
struct Beginning {
  std::vector<ScanBundle> bundles;
  Pose truth;  ///< at the first scan's start
  Vector3 velocity;
};

Beginning begin(const simulation::World& world, const std::shared_ptr<const simulation::Environment>& environment,
                const SensorSuite& suite, const simulation::RandomStart& start, std::uint64_t seed, double data_s) {
  const simulation::World with = with_sequence(world, "start", start.sequence);
  simulation::SimulationSource source(with, environment, "start", simulation::SimulationSource::Drive::sequence, seed,
                                      start.skip_s + data_s + 0.2);
  WarningLog warnings;
  Synchronizer synchronizer(source, suite, warnings);
  Beginning result;
  const Time earliest = source.begin_time() + from_seconds(start.skip_s);
  for (ScanBundle bundle; synchronizer.next(bundle);) {
    if (bundle.scan.start < earliest) continue;
    if (to_seconds(bundle.scan.end - earliest) > data_s) break;
    result.bundles.push_back(bundle);
  }
  ScanBundle& first = result.bundles.front();
  std::erase_if(first.imu, [&](const ImuSample& sample) { return sample.time < first.scan.start; });
  std::erase_if(first.magnetic, [&](const MagneticArraySample& sample) { return sample.time < first.scan.start; });
  const simulation::MotionSample motion = source.motion().at(to_seconds(first.scan.start - source.begin_time()));
  result.truth = motion.T_map_imu;
  result.velocity = motion.velocity;
  return result;
}

double distance(const Pose& a, const Pose& b) {
  return a.boxminus(b).tail<3>().norm();
}
double angle_deg(const Pose& a, const Pose& b) {
  return a.boxminus(b).head<3>().norm() * 180.0 / std::numbers::pi;
}

class StartInARoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto file =
        std::filesystem::temp_directory_path() / ("lodestone-room-" + std::to_string(::getpid()) + ".yaml");
    std::ofstream(file) << kRoom;
    world_ = std::make_unique<simulation::World>(simulation::load_world(file.string()));
    std::filesystem::remove(file);
    environment_ = std::make_shared<const simulation::Environment>(*world_);
    cloud_ = sample_cloud(*world_, *environment_, 1);
    input_ = std::make_unique<EstimatorInput>();
    input_->suite = simulation::sensor_suite(*world_);
    input_->planes = std::make_shared<PlaneMap>(cloud_, PlaneMapOptions{});
    input_->field = true_field(*world_, *environment_, {-8.0, -5.0}, {8.0, 5.0});
  }
  static void TearDownTestSuite() {
    input_.reset();
    environment_.reset();
    world_.reset();
    cloud_.clear();
  }

  static std::vector<simulation::RandomStart> starts(int count, double moving_share) {
    simulation::RandomStarts options;
    options.count = count;
    options.seed = 5;
    options.moving_share = moving_share;
    return random_starts(*environment_, options);
  }
  static Beginning beginning(const simulation::RandomStart& start, double data_s = 1.5) {
    return begin(*world_, environment_, input_->suite, start, 17, data_s);
  }

  static std::unique_ptr<simulation::World> world_;
  static std::shared_ptr<const simulation::Environment> environment_;
  static std::vector<Eigen::Vector3f> cloud_;
  static std::unique_ptr<EstimatorInput> input_;
};
std::unique_ptr<simulation::World> StartInARoom::world_;
std::shared_ptr<const simulation::Environment> StartInARoom::environment_;
std::vector<Eigen::Vector3f> StartInARoom::cloud_;
std::unique_ptr<EstimatorInput> StartInARoom::input_;

TEST_F(StartInARoom, IsFoundWhereTheFieldTellsTheEndsApart) {
  const StartFinder finder(*input_);
  for (const simulation::RandomStart& start : starts(4, 0.0)) {
    const Beginning log = beginning(start);
    const FoundStart found = finder.find(log.bundles);
    ASSERT_FALSE(found.best.empty());
    EXPECT_TRUE(found.sure) << found.doubt;
    EXPECT_LT(distance(found.best.front().T_map_imu, log.truth), 0.05);
    EXPECT_LT(angle_deg(found.best.front().T_map_imu, log.truth), 0.5);
    EXPECT_LT(found.best.front().velocity.norm(), 0.1);
  }
}

TEST_F(StartInARoom, IsNotSureByLidarAlone) {
  EstimatorInput input = *input_;
  input.field = nullptr;
  const StartFinder finder(input);
  for (const simulation::RandomStart& start : starts(4, 0.0)) {
    const Beginning log = beginning(start);
    const FoundStart found = finder.find(log.bundles);
    EXPECT_FALSE(found.sure);
    ASSERT_GE(found.best.size(), 2U);
    // Both ends are among the results: one is the ground truth, the other opposite.
    const Pose opposite{Quaternion(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitZ())) * log.truth.rotation,
                        {-log.truth.position.x(), -log.truth.position.y(), log.truth.position.z()}};
    for (const Pose& place : {log.truth, opposite}) {
      EXPECT_LT(std::min(distance(found.best[0].T_map_imu, place), distance(found.best[1].T_map_imu, place)), 0.05);
    }
    EXPECT_NEAR(found.best[0].probability + found.best[1].probability, 1.0, 0.05);
  }
}

TEST_F(StartInARoom, IsFoundUnderWayWithItsVelocity) {
  const StartFinder finder(*input_);
  const auto moving = starts(2, 1.0);
  ASSERT_FALSE(moving.empty());
  for (const simulation::RandomStart& start : moving) {
    const Beginning log = beginning(start, 2.5);
    ASSERT_GT(log.velocity.norm(), 0.5);
    const FoundStart found = finder.find(log.bundles);
    EXPECT_TRUE(found.sure) << found.doubt;
    ASSERT_FALSE(found.best.empty());
    EXPECT_LT(distance(found.best.front().T_map_imu, log.truth), 0.08);
    EXPECT_LT((found.best.front().velocity - log.velocity).norm(), 0.15);
  }
}

TEST_F(StartInARoom, IsRefusedForAScanOfNothing) {
  const StartFinder finder(*input_);
  Beginning log = beginning(starts(1, 0.0).front());
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<float> place(-6.0F, 6.0F);
  for (ScanBundle& bundle : log.bundles) {
    for (LidarPoint& point : bundle.scan.points) {
      point.position = {place(generator), place(generator), std::abs(place(generator)) * 0.4F};
    }
  }
  EXPECT_FALSE(finder.find(log.bundles).sure);
  for (ScanBundle& bundle : log.bundles) bundle.scan.points.clear();
  EXPECT_THROW(finder.find(log.bundles), InputError);
}

TEST_F(StartInARoom, IsTheSameOnOneAndTwoThreadsAndInTiles) {
  PlaneMapOptions tiles;
  tiles.tile_m = 4.0;
  TiledPlaneMapBuilder builder(tiles, std::filesystem::temp_directory_path().string());
  builder.add(cloud_);
  EstimatorInput tiled = *input_;
  tiled.planes = builder.build(120.0);
  const Beginning log = beginning(starts(1, 0.0).front());
  std::vector<FoundStart> found;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    found.push_back(StartFinder(*input_).find(log.bundles));
  }
  found.push_back(StartFinder(tiled).find(log.bundles));
  for (const FoundStart& other : found) {
    ASSERT_EQ(other.best.size(), found.front().best.size());
    EXPECT_EQ(other.best.front().T_map_imu.position, found.front().best.front().T_map_imu.position);
    EXPECT_EQ(other.best.front().T_map_imu.rotation.coeffs(), found.front().best.front().T_map_imu.rotation.coeffs());
    EXPECT_EQ(other.best.front().probability, found.front().best.front().probability);
  }
}

TEST_F(StartInARoom, NeedsACloudMap) {
  EstimatorInput input = *input_;
  input.planes = nullptr;
  EXPECT_THROW(StartFinder{input}, InputError);
}

}  // namespace
}  // namespace lodestone
