// A lost estimator is initialized again, in a room that looks the same from both ends.
#include "estimators/supervised.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

#include "estimators/ieskf/ieskf.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tests/estimators/room.h"
#include "tests/estimators/wrong_estimators.h"

namespace lodestone {
namespace {

constexpr double kDrive_s = 14.0;

/// Everything but wheels, which the room's robot does not have.
void shift(ScanBundle& bundle, Time by) {
  bundle.scan.start += by;
  bundle.scan.end += by;
  for (ImuSample& sample : bundle.imu) sample.time += by;
  for (MagneticArraySample& sample : bundle.magnetic) sample.time += by;
}

struct Estimates final : EstimateSink {
  std::vector<Estimate> causals;
  std::vector<Estimate> bests;
  void causal(const Estimate& estimate) override { causals.push_back(estimate); }
  void best(const Estimate& estimate) override { bests.push_back(estimate); }
};

class SupervisedInARoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    room_ = std::make_unique<testing::Room>(testing::load_room());
    simulation::SimulationSource source(room_->world, room_->environment, "loop",
                                        simulation::SimulationSource::Drive::sequence, 3, kDrive_s);
    truth_ = source.trajectory();
    WarningLog warnings;
    Synchronizer synchronizer(source, room_->input.suite, warnings);
    for (ScanBundle bundle; synchronizer.next(bundle);) bundles_.push_back(bundle);
  }
  static void TearDownTestSuite() {
    room_.reset();
    bundles_.clear();
    truth_.clear();
  }

  static Estimates estimate(Estimator& estimator, const std::vector<ScanBundle>& bundles) {
    Estimates result;
    for (const ScanBundle& bundle : bundles) estimator.process(bundle, result);
    estimator.finish(result);
    return result;
  }

  /// The room's input, with an initial pose metres away from the robot and turned.
  EstimatorInput wrong_input() {
    EstimatorInput input = room_->input;
    input.initial_pose = truth_.front().pose;
    input.initial_pose.position += Vector3(7.5, 4.0, 0.0);
    input.initial_pose.rotation = Quaternion(Eigen::AngleAxisd(2.0, Vector3::UnitZ())) * input.initial_pose.rotation;
    input.warnings = &warnings_;
    return input;
  }

  /// Each scan has one estimate, in order of time.
  static void expect_every_scan_once(const std::vector<Estimate>& estimates) {
    ASSERT_EQ(estimates.size(), bundles_.size());
    for (std::size_t i = 0; i < estimates.size(); ++i) EXPECT_EQ(estimates[i].time, bundles_[i].scan.end) << i;
  }

  /// Seconds of the log until the first estimate that is lost, or is not.
  static double seconds_until(const std::vector<Estimate>& estimates, bool lost) {
    for (const Estimate& estimate : estimates) {
      if ((estimate.health == Health::lost) == lost) return to_seconds(estimate.time - bundles_.front().scan.start);
    }
    return std::numeric_limits<double>::infinity();
  }

  static void expect_near_the_truth(const Estimate& estimate, double limit_m) {
    const auto truth = interpolate(truth_, estimate.time, 20'000'000);
    ASSERT_TRUE(truth);
    EXPECT_LT((estimate.state.T_map_imu.position - truth->position).norm(), limit_m) << to_seconds(estimate.time);
  }

  static std::unique_ptr<testing::Room> room_;
  static std::vector<ScanBundle> bundles_;
  static Trajectory truth_;
  WarningLog warnings_;
};
std::unique_ptr<testing::Room> SupervisedInARoom::room_;
std::vector<ScanBundle> SupervisedInARoom::bundles_;
Trajectory SupervisedInARoom::truth_;

TEST_F(SupervisedInARoom, AnEstimatorThatLosesItsStateIsReplaced) {
  int made = 0;
  Supervised supervised(wrong_input(), Reckoning::learned_imu,
                        [&](const EstimatorInput& input) -> std::unique_ptr<Estimator> {
                          if (++made == 1) return std::make_unique<testing::LosesItsState>();
                          return std::make_unique<IteratedFilter>(input);
                        });
  const Estimates result = estimate(supervised, bundles_);
  EXPECT_EQ(made, 2);
  EXPECT_EQ(warnings_.count("run.found_again"), 1);
  expect_every_scan_once(result.causals);
  expect_every_scan_once(result.bests);
  EXPECT_EQ(result.causals.front().reason, HealthReason::not_finite);
  EXPECT_LT(seconds_until(result.causals, false), 5.5);  // the second search has 4.5 s of data
  bool found = false;
  for (const Estimate& causal : result.causals) {
    if (causal.health == Health::lost) {
      EXPECT_FALSE(found) << to_seconds(causal.time);
      continue;
    }
    found = true;
    expect_near_the_truth(causal, 0.1);
  }
}

/// A place that is left was wrong or is now: exit code and status must not say that all is well.
TEST_F(SupervisedInARoom, AnEstimatorThatIsLeftInDoubtWasLost) {
  int made = 0;
  Supervised supervised(wrong_input(), Reckoning::learned_imu,
                        [&](const EstimatorInput& input) -> std::unique_ptr<Estimator> {
                          if (++made == 1) return std::make_unique<testing::AtTheOtherEnd>(truth_);
                          return std::make_unique<IteratedFilter>(input);
                        });
  const Estimates result = estimate(supervised, bundles_);
  EXPECT_EQ(made, 2);
  expect_every_scan_once(result.causals);
  expect_every_scan_once(result.bests);
  int lost = 0;
  int good_again = 0;
  for (const Estimate& causal : result.causals) {
    if (causal.health == Health::lost) {
      ++lost;
      EXPECT_EQ(causal.reason, HealthReason::field_off_map);
    } else if (lost > 0) {
      ++good_again;
      expect_near_the_truth(causal, 0.1);
    }
  }
  EXPECT_EQ(lost, 1);
  EXPECT_GT(good_again, 0);
}

/// Nothing contradicts an estimate that is lost by its covariance, so the robot is within it. The other end is more
/// than 10.2 m away in the first 5 s, and a sigma must be above 3 m for a loss.
TEST_F(SupervisedInARoom, APlaceBeyondAnUnknownEstimateIsNotBelieved) {
  for (const double sigma_m : {3.05, 10.0}) {
    Time now = 0;
    Time second = 0;
    int made = 0;
    Supervised supervised(wrong_input(), Reckoning::learned_imu,
                          [&](const EstimatorInput& input) -> std::unique_ptr<Estimator> {
                            if (++made == 1) return std::make_unique<testing::AtTheOtherEnd>(truth_, sigma_m, 1.0);
                            if (made == 2) second = now;
                            return std::make_unique<IteratedFilter>(input);
                          });
    Estimates result;
    for (const ScanBundle& bundle : bundles_) {
      now = bundle.scan.end;
      if (to_seconds(now - bundles_.front().scan.start) < 5.0) supervised.process(bundle, result);
    }
    EXPECT_EQ(made, sigma_m > 5.0 ? 2 : 1);
    if (made == 2) EXPECT_LT(to_seconds(second - bundles_.front().scan.start), 2.0);
    EXPECT_EQ(result.causals.front().reason, HealthReason::covariance);
  }
}

/// Most of the scan fits 0.5 m beside the place, and the rule that compares it with decoys metres away says nothing.
TEST_F(SupervisedInARoom, AnEstimateBesideTheTruthIsMovedThere) {
  for (const bool moves : {true, false}) {
    EstimatorInput input = room_->input;
    input.initial_pose = truth_.front().pose;
    input.field = nullptr;
    WarningLog warnings;
    input.warnings = &warnings;
    int made = 0;
    Supervised supervised(input, Reckoning::learned_imu,
                          [&](const EstimatorInput& again) -> std::unique_ptr<Estimator> {
                            if (++made == 1) return std::make_unique<testing::BesideTheTruth>(truth_, moves);
                            return std::make_unique<IteratedFilter>(again);
                          });
    const Estimates result = estimate(supervised, bundles_);
    EXPECT_EQ(made, moves ? 1 : 2);
    EXPECT_EQ(warnings.count(moves ? "run.moved" : "run.found_again"), 1);
    expect_every_scan_once(result.causals);
    expect_every_scan_once(result.bests);
    const Time wrong = bundles_.front().scan.end + 3'000'000'000;
    int in_doubt = 0;
    for (const Estimate& causal : result.causals) {
      in_doubt += causal.health == Health::uncertain && causal.reason == HealthReason::scan_off_map ? 1 : 0;
      if (causal.time <= wrong || causal.time > wrong + 2'500'000'000) expect_near_the_truth(causal, 0.1);
    }
    EXPECT_GT(in_doubt, 0);
  }
}

TEST_F(SupervisedInARoom, AnEstimatorAtAWrongPlaceIsLostAndFoundAgain) {
  const auto smoother = make_estimator("smoother", wrong_input());
  const Estimates result = estimate(*smoother, bundles_);
  EXPECT_LT(seconds_until(result.causals, true), 5.0);
  EXPECT_GE(warnings_.count("run.found_again"), 1);
  EXPECT_NE(result.causals.back().health, Health::lost);
  expect_near_the_truth(result.causals.back(), 0.1);
  expect_near_the_truth(result.bests.back(), 0.1);
  expect_every_scan_once(result.causals);
  expect_every_scan_once(result.bests);
}

/// No robot drives 5.5 m within a scan. Before, the first search was believed.
TEST_F(SupervisedInARoom, APlaceOutOfReachIsFoundTwiceBeforeItIsBelieved) {
  testing::RoomDrive drive = testing::drive_through_room(3, 24.0);
  constexpr std::size_t kJump = 40;
  constexpr std::size_t kScans = 55;
  const Time jump = drive.bundles[kJump].scan.start;
  const Time left_out = drive.bundles[kJump + kScans].scan.start - jump;
  drive.bundles.erase(drive.bundles.begin() + kJump, drive.bundles.begin() + kJump + kScans);
  for (std::size_t i = kJump; i < drive.bundles.size(); ++i) shift(drive.bundles[i], -left_out);
  const auto filter = make_estimator("ieskf", drive.room.input);
  const Estimates result = estimate(*filter, drive.bundles);
  double found_after_s = 0.0;
  for (const Estimate& causal : result.causals) {
    if (causal.health != Health::good || causal.time <= jump) continue;
    const auto truth = interpolate(drive.truth, causal.time + left_out, 20'000'000);
    ASSERT_TRUE(truth);
    const bool right = (causal.state.T_map_imu.position - truth->position).norm() < 0.1;
    if (right && found_after_s == 0.0) found_after_s = to_seconds(causal.time - jump);
    EXPECT_TRUE(right || causal.time < jump + 2'000'000'000) << to_seconds(causal.time - jump);
  }
  std::printf("found after %.2f s\n", found_after_s);
  EXPECT_GT(found_after_s, drive.room.input.options.search.data_s);
}

// The LiDAR is mounted 3 degrees from what the platform file says. The smoother finds this, and moves scans by it.
TEST_F(SupervisedInARoom, AScanIsJudgedWhereTheSmootherSeesIt) {
  EstimatorInput input = room_->input;
  input.initial_pose = truth_.front().pose;
  Quaternion& rotation = input.suite.lidar.T_imu_lidar.rotation;
  rotation = so3::exp({0.03, -0.03, 0.03}) * rotation;
  input.suite.calibration.lidar.rotation_sigma_deg = 2.0;
  const auto smoother = make_estimator("smoother", input);
  const Estimates result = estimate(*smoother, bundles_);
  double least = 1.0;
  for (const Estimate& causal : result.causals) least = std::min(least, causal.diagnostics.place_share);
  EXPECT_GT(least, 0.95);
  ASSERT_TRUE(smoother->calibration() != nullptr);
  EXPECT_GT(smoother->calibration()->lidar.correction.turn_rad.norm(), 0.03);  // of 0.052; the rest is not seen
}

TEST_F(SupervisedInARoom, WithoutAPlaceEachScanIsReportedAsLost) {
  std::vector<ScanBundle> empty = bundles_;
  for (ScanBundle& bundle : empty) bundle.scan.points.clear();
  int made = 0;
  Supervised supervised(wrong_input(), Reckoning::learned_imu, [&](const EstimatorInput&) {
    ++made;
    return std::make_unique<testing::LosesItsState>();
  });
  const Estimates result = estimate(supervised, empty);
  EXPECT_EQ(made, 1);
  EXPECT_EQ(warnings_.count("run.found_again"), 0);
  expect_every_scan_once(result.causals);
  expect_every_scan_once(result.bests);
  for (const Estimate& best : result.bests) EXPECT_EQ(best.health, Health::lost);
  EXPECT_EQ(result.bests.back().reason, HealthReason::searching);
}

/// No sensor for 4 s: what the IMU said before it says nothing about the time after it.
TEST_F(SupervisedInARoom, AfterAnOutageOfAllSensorsTheRobotIsFoundAgain) {
  constexpr double kBegin_s = 3.0;
  constexpr double kEnd_s = 7.0;
  std::vector<ScanBundle> bundles = bundles_;
  for (ScanBundle& bundle : bundles) {
    const double end_s = to_seconds(bundle.scan.end - bundles_.front().scan.start);
    if (end_s < kBegin_s || end_s > kEnd_s) continue;
    bundle.scan.points.clear();
    bundle.magnetic.clear();
    bundle.imu = {bundle.imu.front(), bundle.imu.back()};
    bundle.imu_gap_s = kEnd_s - kBegin_s;
  }
  EstimatorInput input = room_->input;
  input.initial_pose = truth_.front().pose;
  input.warnings = &warnings_;
  const auto smoother = make_estimator("smoother", input);
  const Estimates result = estimate(*smoother, bundles);
  expect_every_scan_once(result.causals);
  expect_every_scan_once(result.bests);
  EXPECT_EQ(warnings_.count("run.found_again"), 1);
  for (const Estimate& causal : result.causals) {
    const double t_s = to_seconds(causal.time - bundles_.front().scan.start);
    if (t_s > kBegin_s + 3.0 && t_s < kEnd_s) {
      EXPECT_EQ(causal.health, Health::lost) << t_s;
    }
    if (t_s > kEnd_s + 3.0) {
      EXPECT_EQ(causal.health, Health::good) << t_s;
    }
    if (causal.health == Health::good) expect_near_the_truth(causal, 0.5);
  }
}

/// No scan for 5 s, in which a poor IMU carries the pose: the errors are as large as the covariance says, and the scans
/// after it are used at the right place.
TEST_F(SupervisedInARoom, AfterAGapOfScansTheRightPlaceIsFound) {
  std::mt19937 random(4);
  std::normal_distribution<double> unit;
  constexpr double kRate_hz = 200.0;
  EstimatorInput input = room_->input;
  input.field = nullptr;
  input.suite.magnetometers.clear();
  input.suite.imu.gyroscope_noise_density = 3e-3;
  input.suite.imu.accelerometer_noise_density = 0.15;
  input.initial_pose = truth_.front().pose;
  input.warnings = &warnings_;
  const auto noise = [&](double density) {
    return density * std::sqrt(kRate_hz) * Vector3(unit(random), unit(random), unit(random));
  };
  std::vector<ScanBundle> bundles = bundles_;
  for (ScanBundle& bundle : bundles) {
    bundle.magnetic.clear();
    for (ImuSample& sample : bundle.imu) {
      sample.angular_velocity += noise(input.suite.imu.gyroscope_noise_density);
      sample.linear_acceleration += noise(input.suite.imu.accelerometer_noise_density);
    }
    const double end_s = to_seconds(bundle.scan.end - bundles_.front().scan.start);
    if (end_s > 4.0 && end_s < 9.0) bundle.scan.points.clear();
  }
  const auto smoother = make_estimator("smoother", input);
  const Estimates result = estimate(*smoother, bundles);
  expect_every_scan_once(result.bests);
  double widest_m = 0.0;
  for (const Estimate& best : result.bests) {
    if (best.health == Health::lost) continue;
    const auto truth = interpolate(truth_, best.time, 20'000'000);
    const Vector3 error = best.state.T_map_imu.position - truth->position;
    const Matrix3 covariance = best.covariance.bottomRightCorner<3, 3>();
    EXPECT_LT(error.dot(covariance.ldlt().solve(error)), 30.0) << to_seconds(best.time);
    widest_m = std::max(widest_m, std::sqrt(covariance.trace()));
  }
  EXPECT_GT(widest_m, 0.2);
  expect_near_the_truth(result.bests.back(), 0.1);
  EXPECT_EQ(result.causals.back().health, Health::good);
}

TEST_F(SupervisedInARoom, WithoutACloudMapTheEstimatorContinues) {
  EstimatorInput input = wrong_input();
  input.planes = nullptr;
  Supervised supervised(input, Reckoning::learned_imu,
                        [](const EstimatorInput&) { return std::make_unique<testing::LosesItsState>(); });
  const Estimates result = estimate(supervised, bundles_);
  expect_every_scan_once(result.causals);
  EXPECT_EQ(result.causals.back().reason, HealthReason::not_finite);
}

}  // namespace
}  // namespace lodestone
