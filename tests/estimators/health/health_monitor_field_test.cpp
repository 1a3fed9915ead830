#include <gtest/gtest.h>

#include "estimators/health/health_monitor.h"
#include "tests/estimators/health/estimates.h"
#include "tests/estimators/room.h"

namespace lodestone {
namespace {

using testing::kStep_s;
using testing::with_sigma;

/// The room's field map, moved by `offset_m`.
std::shared_ptr<const MagneticMap> moved_field(const MagneticMap& field, const Eigen::Vector2d& offset_m) {
  FieldGrid grid = field.grid();
  grid.origin += offset_m;
  return std::make_shared<MagneticMap>(grid, field.nodes(), field.max_sigma_ut());
}

const testing::RoomDrive& drive_of_nine_metres() {
  static const testing::RoomDrive drive = testing::drive_through_room(3, 9.0);
  return drive;
}

/// At the true pose of a scan of the drive.
Estimate true_estimate(const ScanBundle& bundle) {
  const auto& truth = drive_of_nine_metres().truth;
  Estimate estimate = with_sigma(0.01);
  estimate.time = bundle.scan.end;
  estimate.state.T_map_imu = *interpolate(truth, bundle.scan.end, 20'000'000);
  const Pose before = *interpolate(truth, bundle.scan.start, 20'000'000);
  estimate.state.velocity =
      (estimate.state.T_map_imu.position - before.position) / to_seconds(bundle.scan.end - bundle.scan.start);
  estimate.diagnostics.correspondences = 1000;
  return estimate;
}

/// Verdicts on the true poses of a drive of which the magnetic map is `offset_m` off.
std::vector<Verdict> verdicts_with_field_at(const Eigen::Vector2d& offset_m, int unobserved_directions,
                                            int degenerate_directions = 0, int set_aside = 0) {
  EstimatorInput input = drive_of_nine_metres().room.input;
  input.field = moved_field(*input.field, offset_m);
  HealthMonitor monitor(input, Reckoning::learned_imu);
  std::vector<Verdict> verdicts;
  for (const ScanBundle& bundle : drive_of_nine_metres().bundles) {
    Estimate estimate = true_estimate(bundle);
    estimate.diagnostics.unobserved_directions = unobserved_directions;
    estimate.diagnostics.degenerate_directions = degenerate_directions;
    estimate.diagnostics.magnetic_set_aside = set_aside;
    estimate.diagnostics.magnetic_samples = 4;
    estimate.diagnostics.magnetic_weight = 1.0;  // of a filter that finds its own prediction in each sample
    monitor.judge(bundle, estimate);
    verdicts.push_back({estimate.health, estimate.reason});
  }
  return verdicts;
}

TEST(MonitorOfField, ReadingsThatFitNowhereNearAreFoundWhateverTheirWeightsWhereTheyAloneObserve) {
  for (const int unobserved : {0, 1}) {
    for (const Verdict& verdict : verdicts_with_field_at({0.0, 0.0}, unobserved)) {
      EXPECT_EQ(verdict.health, Health::good);
    }
  }
  for (const Eigen::Vector2d& offset_m : {Eigen::Vector2d{1.0, 0.0}, Eigen::Vector2d{0.0, -1.5}}) {
    for (const int degenerate : {0, 1}) {  // directions that the estimator knows of
      const std::vector<Verdict> alone = verdicts_with_field_at(offset_m, 1, degenerate);
      EXPECT_EQ(alone.back().health, Health::lost);
      EXPECT_EQ(alone.back().reason, HealthReason::field_off_map);
      EXPECT_EQ(alone[alone.size() / 4].health, Health::good);  // two metres say too little
    }
    // The map may have changed, or a magnetometer may be wrong, which an estimator with a true covariance finds.
    EXPECT_EQ(verdicts_with_field_at(offset_m, 0).back().health, Health::good);
    EXPECT_EQ(verdicts_with_field_at(offset_m, 1, 1, 1).back().health, Health::good);
    // One that does not know of the direction weighs its readings by a wrong covariance, and sets them aside by it.
    EXPECT_EQ(verdicts_with_field_at(offset_m, 1, 0, 1).back().health, Health::lost);
  }
}

/// The newest verdict on an estimate that stands at the first pose of a drive of which the magnetic map is wrong.
Verdict verdict_on_a_standing_estimate(bool robot_drives) {
  EstimatorInput input = drive_of_nine_metres().room.input;
  input.field = moved_field(*input.field, {1.0, 0.0});
  HealthMonitor monitor(input, Reckoning::learned_imu);
  const ScanBundle& first = drive_of_nine_metres().bundles.front();
  Estimate estimate = true_estimate(first);
  estimate.state.velocity.setZero();
  estimate.diagnostics.unobserved_directions = 1;
  estimate.diagnostics.degenerate_directions = 1;
  estimate.diagnostics.magnetic_samples = 4;
  estimate.diagnostics.magnetic_weight = 1.0;
  for (const ScanBundle& bundle : drive_of_nine_metres().bundles) {
    estimate.time = bundle.scan.end;
    monitor.judge(robot_drives ? bundle : first, estimate);
  }
  return {estimate.health, estimate.reason};
}

/// Each reading of a robot that stands says the same. Those of a robot that drives do not, wherever its estimate is.
TEST(MonitorOfField, AnEstimateThatStandsWhileItsReadingsChangeIsLost) {
  EXPECT_EQ(verdict_on_a_standing_estimate(false).health, Health::good);
  EXPECT_EQ(verdict_on_a_standing_estimate(true).health, Health::lost);
  EXPECT_EQ(verdict_on_a_standing_estimate(true).reason, HealthReason::field_off_map);
}

/// A magnetic map that has changed over some metres is no reason to give up a pose that readings have just confirmed;
/// after seven seconds, dead reckoning tells no more than half a metre. `until_lost_s`: of readings that contradict.
double until_lost_s(const Eigen::Vector2d& offset_m) {
  EstimatorInput input = drive_of_nine_metres().room.input;
  input.field = moved_field(*input.field, offset_m);
  HealthMonitor monitor(input, Reckoning::learned_imu);
  Estimate estimate;
  for (const ScanBundle& bundle : drive_of_nine_metres().bundles) {
    estimate = true_estimate(bundle);
    monitor.judge(bundle, estimate);
  }
  EXPECT_EQ(estimate.health, Health::good);
  EXPECT_EQ(monitor.is_confirmed(), offset_m.isZero());
  const Time begin = estimate.time;
  estimate.state.velocity.setZero();
  estimate.diagnostics.unobserved_directions = 1;
  estimate.diagnostics.degenerate_directions = 1;
  estimate.diagnostics.magnetic_set_aside = 4;
  estimate.diagnostics.magnetic_samples = 4;
  estimate.diagnostics.magnetic_weight = 0.02;
  while (estimate.health != Health::lost && to_seconds(estimate.time - begin) < 20.0) {
    estimate.time += from_seconds(0.1);
    monitor.judge({}, estimate);
  }
  EXPECT_FALSE(monitor.is_confirmed());
  return to_seconds(estimate.time - begin);
}

TEST(MonitorOfField, AConfirmedPoseOutlastsAMapThatHasChangedOverSomeMetres) {
  EXPECT_NEAR(until_lost_s({0.0, 0.0}), 7.1, 0.3);   // sqrt(2 · 0.5 m / 0.02 m/s²)
  EXPECT_NEAR(until_lost_s({0.0, -1.5}), 2.3, 0.4);  // 3 s · ln(1 / 0.5): nothing has confirmed this pose
}

/// Readings that fit over some metres, where scans observe all directions, tell the place that dead reckoning lost.
TEST(MonitorOfField, ReadingsTellThePlaceThatDeadReckoningLost) {
  for (const Eigen::Vector2d& offset_m : {Eigen::Vector2d{0.0, 0.0}, Eigen::Vector2d{0.0, -1.5}}) {
    EstimatorInput input = drive_of_nine_metres().room.input;
    input.field = moved_field(*input.field, offset_m);
    HealthMonitor monitor(input, Reckoning::learned_imu);
    Estimate estimate = true_estimate(drive_of_nine_metres().bundles.front());
    estimate.diagnostics.unobserved_directions = 1;
    estimate.time -= from_seconds(20.0);
    for (int i = 1; i < 200; ++i) {
      estimate.time += from_seconds(kStep_s);
      monitor.judge({}, estimate);
    }
    EXPECT_EQ(estimate.reason, HealthReason::unobserved);
    for (const ScanBundle& bundle : drive_of_nine_metres().bundles) {
      estimate = true_estimate(bundle);
      monitor.judge(bundle, estimate);
    }
    EXPECT_EQ(estimate.health, offset_m.isZero() ? Health::good : Health::lost);
  }
}

/// Without a cloud map, a covariance that becomes small does not end a loss: the readings of some metres must fit. Then
/// refined estimates of these metres are good, too.
TEST(MonitorOfField, AnEstimateWithoutScansIsLostUntilReadingsFit) {
  for (const bool fits : {true, false}) {
    EstimatorInput input = drive_of_nine_metres().room.input;
    input.planes = nullptr;
    if (!fits) input.field = moved_field(*input.field, {1.0, 0.0});
    HealthMonitor monitor(input, Reckoning::learned_imu);
    std::vector<Health> causal;
    std::vector<Estimate> estimates;
    for (const ScanBundle& bundle : drive_of_nine_metres().bundles) {
      Estimate estimate = true_estimate(bundle);
      if (causal.empty()) estimate.covariance *= 1e6;
      estimate.diagnostics.correspondences = 0;
      estimate.diagnostics.magnetic_samples = 4;
      estimate.diagnostics.magnetic_weight = 1.0;
      monitor.judge(bundle, estimate);
      causal.push_back(estimate.health);
      estimates.push_back(estimate);
    }
    EXPECT_EQ(causal[causal.size() / 4], Health::lost);
    EXPECT_EQ(causal.back(), fits ? Health::good : Health::lost);
    EXPECT_EQ(monitor.judge_refined(estimates[estimates.size() / 4]).health, fits ? Health::good : Health::lost);
  }
}

}  // namespace
}  // namespace lodestone
