// Initial pose anywhere on the map of a room that looks the same from both ends.
#include "estimators/initialization/start_finder.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"
#include "frontends/maps/tiled_plane_map.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tests/estimators/initialization/random_starts.h"
#include "tests/estimators/room.h"

namespace lodestone {
namespace {

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
  static void SetUpTestSuite() { room_ = std::make_unique<testing::Room>(testing::load_room()); }
  static void TearDownTestSuite() { room_.reset(); }

  static std::vector<simulation::RandomStart> starts(int count, double moving_share) {
    simulation::RandomStarts options;
    options.count = count;
    options.seed = 5;
    options.moving_share = moving_share;
    return random_starts(*room_->environment, options);
  }
  static Beginning beginning(const simulation::RandomStart& start, double data_s = 1.5) {
    return begin(room_->world, room_->environment, room_->input.suite, start, 17, data_s);
  }

  static std::unique_ptr<testing::Room> room_;
};
std::unique_ptr<testing::Room> StartInARoom::room_;

TEST_F(StartInARoom, IsFoundWhereTheFieldTellsTheEndsApart) {
  const StartFinder finder(room_->input);
  for (const simulation::RandomStart& start : starts(4, 0.0)) {
    const Beginning log = beginning(start);
    const FoundStart found = finder.find(log.bundles);
    ASSERT_FALSE(found.best.empty());
    EXPECT_TRUE(found.sure) << found.doubt;
    EXPECT_LT(distance(found.best.front().T_map_imu, log.truth), 0.05);
    EXPECT_LT(angle_deg(found.best.front().T_map_imu, log.truth), 0.5);
    EXPECT_LT(found.best.front().velocity.norm(), 0.1);
    const auto sure = finder.find_sure(log.bundles, {});
    ASSERT_TRUE(sure.has_value());
    EXPECT_EQ(sure->T_map_imu.boxminus(found.best.front().T_map_imu).norm(), 0.0);
  }
}

TEST_F(StartInARoom, IsNotSureByLidarAlone) {
  EstimatorInput input = room_->input;
  input.field = nullptr;
  const StartFinder finder(input);
  for (const simulation::RandomStart& start : starts(4, 0.0)) {
    const Beginning log = beginning(start);
    const FoundStart found = finder.find(log.bundles);
    EXPECT_FALSE(found.sure);
    EXPECT_FALSE(finder.find_sure(log.bundles, {}).has_value());
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

/// The map has no floor at one end, so that the search finds the other end alone.
TEST_F(StartInARoom, CompetesWithSupposedPlaces) {
  std::vector<Eigen::Vector3f> cloud = room_->cloud;
  std::erase_if(cloud, [](const Eigen::Vector3f& point) { return point.z() < 0.1F && point.x() > 0.5F; });
  EstimatorInput input = room_->input;
  input.field = nullptr;
  input.planes = std::make_shared<PlaneMap>(cloud, PlaneMapOptions{});
  const StartFinder finder(input);
  int compared = 0;
  for (const simulation::RandomStart& start : starts(8, 0.0)) {
    const Beginning log = beginning(start);
    if (std::abs(log.truth.position.x()) < 1.5) continue;
    const Pose half_turn{Quaternion(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitZ())), Vector3::Zero()};
    const Pose other_end = half_turn * log.truth;
    const bool truth_is_standable = log.truth.position.x() < 0.0;
    const auto alone = finder.find_sure(log.bundles, {});
    ASSERT_TRUE(alone.has_value());
    EXPECT_LT(distance(alone->T_map_imu, truth_is_standable ? log.truth : other_end), 0.05);
    EXPECT_TRUE(finder.find_sure(log.bundles, std::vector{alone->T_map_imu}).has_value());
    EXPECT_FALSE(finder.find_sure(log.bundles, std::vector{truth_is_standable ? other_end : log.truth}).has_value());
    ++compared;
  }
  EXPECT_GE(compared, 3);
}

TEST_F(StartInARoom, IsFoundUnderWayWithItsVelocity) {
  const StartFinder finder(room_->input);
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

/// Of each `every` scans after the first, the last one with the measurements of all.
std::vector<ScanBundle> rare_scans(const std::vector<ScanBundle>& bundles, std::size_t every) {
  std::vector<ScanBundle> result{bundles.front()};
  for (std::size_t i = 1; i + every <= bundles.size(); i += every) {
    ScanBundle rare = bundles[i + every - 1];
    rare.imu = imu_of(std::span(bundles).subspan(i, every));
    rare.magnetic.clear();
    for (std::size_t k = i; k < i + every; ++k) {
      rare.magnetic.insert(rare.magnetic.end(), bundles[k].magnetic.begin(), bundles[k].magnetic.end());
    }
    result.push_back(rare);
  }
  return result;
}

/// Between two scans, the robot moves by more than a registration corrects.
TEST_F(StartInARoom, IsFoundUnderWayByRareScans) {
  const StartFinder finder(room_->input);
  for (const simulation::RandomStart& start : starts(4, 1.0)) {
    const Beginning log = beginning(start, 2.5);
    const FoundStart found = finder.find(rare_scans(log.bundles, 5));
    EXPECT_TRUE(found.sure) << found.doubt;
    ASSERT_FALSE(found.best.empty());
    EXPECT_LT(distance(found.best.front().T_map_imu, log.truth), 0.08);
    EXPECT_LT((found.best.front().velocity - log.velocity).norm(), 0.15);
  }
}

TEST_F(StartInARoom, IsAmongTheResultsIfTheScanSeesOnlyTheFloorAndPeople) {
  const StartFinder finder(room_->input);
  for (const simulation::RandomStart& start : starts(4, 0.0)) {
    Beginning log = beginning(start);
    for (ScanBundle& bundle : log.bundles) {
      std::vector<LidarPoint>& points = bundle.scan.points;
      const auto by_height = [](const LidarPoint& a, const LidarPoint& b) { return a.position.z() < b.position.z(); };
      const float floor_m = std::min_element(points.begin(), points.end(), by_height)->position.z();
      std::vector<LidarPoint> seen;
      std::copy_if(points.begin(), points.end(), std::back_inserter(seen),
                   [&](const LidarPoint& point) { return point.position.z() < floor_m + 0.1F; });
      for (const auto& [x, y] : {std::pair{2.2F, 1.1F}, {-1.5F, -2.8F}, {1.0F, -2.0F}}) {  // people, at rest
        for (int i = 0; i < 120; ++i) {
          LidarPoint point = points.front();
          point.position = {x + 0.02F * static_cast<float>(i % 8), y + 0.015F * static_cast<float>(i % 20),
                            floor_m + 0.2F + 0.012F * static_cast<float>(i)};
          seen.push_back(point);
        }
      }
      points = seen;
    }
    const FoundStart found = finder.find(log.bundles);
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const StartHypothesis& one : found.best) nearest_m = std::min(nearest_m, distance(one.T_map_imu, log.truth));
    constexpr double kSigma_m = 0.5;  // of a found pose, begin_at()
    EXPECT_LT(nearest_m, kSigma_m);
    if (found.sure) {
      EXPECT_LT(distance(found.best.front().T_map_imu, log.truth), 3.0 * kSigma_m);
    }
  }
}

TEST_F(StartInARoom, IsRefusedForAScanOfNothing) {
  const StartFinder finder(room_->input);
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
  builder.add(room_->cloud);
  EstimatorInput tiled = room_->input;
  tiled.planes = builder.build(120.0);
  const Beginning log = beginning(starts(1, 0.0).front());
  std::vector<FoundStart> found;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    found.push_back(StartFinder(room_->input).find(log.bundles));
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
  EstimatorInput input = room_->input;
  input.planes = nullptr;
  EXPECT_THROW(StartFinder{input}, InputError);
}

}  // namespace
}  // namespace lodestone
