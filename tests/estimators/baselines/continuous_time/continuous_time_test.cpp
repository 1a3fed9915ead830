// The room has no degenerate direction: the filter is as accurate there as its authors state.
#include "estimators/baselines/continuous_time/continuous_time.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "core/error.h"
#include "tests/estimators/drive.h"
#include "tests/estimators/room.h"

namespace lodestone::testing {
namespace {

constexpr double room_drive_s = 16.0;  // with a curve

class ContinuousTimeInARoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { drive_ = std::make_unique<RoomDrive>(drive_through_room(4, room_drive_s)); }
  static void TearDownTestSuite() { drive_.reset(); }

  static Collector estimate(const ContinuousTimeOptions& options, const std::vector<ScanBundle>& bundles) {
    Collector result;
    ContinuousTime estimator(drive_->room.input, options);
    for (const ScanBundle& bundle : bundles) static_cast<Estimator&>(estimator).process(bundle, result);
    estimator.finish(result);
    return result;
  }

  static double mean_points(const Collector& result) {
    double sum = 0.0;
    for (const Estimate& estimate : result.best_estimates) sum += estimate.diagnostics.points;
    return sum / static_cast<double>(result.best_estimates.size());
  }

  static void expect_same_bits(const Collector& a, const Collector& b) {
    ASSERT_EQ(a.best_estimates.size(), b.best_estimates.size());
    for (std::size_t i = 0; i < a.best_estimates.size(); ++i) {
      const NavState& first = a.best_estimates[i].state;
      const NavState& second = b.best_estimates[i].state;
      ASSERT_EQ(first.T_map_imu.position, second.T_map_imu.position) << i;
      ASSERT_EQ(first.T_map_imu.rotation.coeffs(), second.T_map_imu.rotation.coeffs()) << i;
      ASSERT_EQ(a.best_estimates[i].covariance, b.best_estimates[i].covariance) << i;
    }
  }

  static inline std::unique_ptr<RoomDrive> drive_;
};

TEST_F(ContinuousTimeInARoom, TracksTheRobotWithinTheErrorOfItsPaper) {
  const Collector result = run("continuous-time", drive_->room.input, drive_->bundles);
  ASSERT_EQ(result.causal_estimates.size(), drive_->bundles.size());
  ASSERT_EQ(result.best_estimates.size(), drive_->bundles.size());
  const Accuracy found = accuracy(result.best_estimates, drive_->truth);
  EXPECT_LT(found.ate_m, 0.01);  // MIL-LC: 0.036 m in its warehouse
  EXPECT_LT(found.max_m, 0.05);
  EXPECT_LT(found.nees, 5.0);  // the robot enters curves faster than the published densities expect
  for (std::size_t i = 0; i < drive_->bundles.size(); ++i) {
    EXPECT_EQ(result.best_estimates[i].time, drive_->bundles[i].scan.end);
    EXPECT_EQ(result.best_estimates[i].health, Health::good) << i;
    EXPECT_GT(result.best_estimates[i].diagnostics.inlier_share, 0.5) << i;
  }
}

TEST_F(ContinuousTimeInARoom, UsesTheTimeOfEachPoint) {
  std::vector<ScanBundle> frozen = drive_->bundles;
  for (ScanBundle& bundle : frozen) {
    for (LidarPoint& point : bundle.scan.points) {
      point.offset_ns = static_cast<std::int32_t>(bundle.scan.end - bundle.scan.start);
    }
  }
  const double with_times_m = accuracy(estimate({}, drive_->bundles).best_estimates, drive_->truth).ate_m;
  EXPECT_GT(accuracy(estimate({}, frozen).best_estimates, drive_->truth).ate_m, 3.0 * with_times_m);
}

TEST_F(ContinuousTimeInARoom, SamplingUsesFewerPointsAndStaysAccurate) {
  ContinuousTimeOptions all;
  all.min_localizability = 0.0;
  ContinuousTimeOptions some;
  some.min_localizability = 150.0;
  const Collector with_all = estimate(all, drive_->bundles);
  const Collector with_some = estimate(some, drive_->bundles);
  EXPECT_LT(mean_points(with_some), 0.6 * mean_points(with_all));
  EXPECT_LT(accuracy(with_some.best_estimates, drive_->truth).ate_m,
            2.0 * accuracy(with_all.best_estimates, drive_->truth).ate_m);
}

TEST_F(ContinuousTimeInARoom, TakesNothingFromImuAndMagnetometers) {
  std::vector<ScanBundle> bare = drive_->bundles;
  for (ScanBundle& bundle : bare) {
    bundle.imu.clear();
    bundle.magnetic.clear();
  }
  expect_same_bits(estimate({}, drive_->bundles), estimate({}, bare));
}

TEST_F(ContinuousTimeInARoom, GivesTheSameBitsOnAnyNumberOfThreads) {
  const std::vector<ScanBundle> part(drive_->bundles.begin(), drive_->bundles.begin() + 40);
  std::vector<Collector> results;
  for (const int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    results.push_back(estimate({}, part));
  }
  expect_same_bits(results[0], results[1]);
  expect_same_bits(results[0], results[2]);
}

// Without points the velocity is kept, and the sigma grows; the next scan finds the robot again.
TEST_F(ContinuousTimeInARoom, PredictsThroughAnOutage) {
  std::vector<ScanBundle> bundles(drive_->bundles.begin(), drive_->bundles.begin() + 80);
  for (std::size_t i = 50; i < 55; ++i) bundles[i].scan.points.clear();
  const Collector result = estimate({}, bundles);
  const auto sigma_m = [&](std::size_t i) { return std::sqrt(result.best_estimates[i].covariance(3, 3)); };
  for (std::size_t i = 50; i < 55; ++i) EXPECT_GT(sigma_m(i), sigma_m(i - 1)) << i;
  EXPECT_LT(sigma_m(56), 1.5 * sigma_m(49));
  EXPECT_EQ(result.best_estimates[54].diagnostics.correspondences, 0);
  EXPECT_LT(accuracy(result.best_estimates, drive_->truth).max_m, 0.1);
}

// The room looks alike when turned, and LiDAR is all that this estimator has: the search is never sure.
TEST_F(ContinuousTimeInARoom, SaysThatItIsLostAtAWrongInitialPose) {
  EstimatorInput input = drive_->room.input;
  input.initial_pose.position += Vector3(7.5, 4.0, 0.0);
  input.initial_pose.rotation = so3::exp({0.0, 0.0, 2.0}) * input.initial_pose.rotation;
  WarningLog warnings;
  input.warnings = &warnings;
  const Collector result = run("continuous-time", input, drive_->bundles);
  EXPECT_EQ(warnings.count("run.found_again"), 0);
  EXPECT_EQ(result.causal_estimates.back().health, Health::lost);
}

TEST_F(ContinuousTimeInARoom, RequiresACloudMap) {
  EstimatorInput input = drive_->room.input;
  input.planes = nullptr;
  try {
    make_estimator("continuous-time", input);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--cloud"), std::string::npos);
  }
}

}  // namespace
}  // namespace lodestone::testing
