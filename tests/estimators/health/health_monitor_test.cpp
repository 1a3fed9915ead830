#include "estimators/health/health_monitor.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/lidar/plane_map.h"
#include "tests/estimators/room.h"

namespace lodestone {
namespace {

constexpr double kStep_s = 0.1;

Estimate with_sigma(double sigma_m) {
  Estimate estimate;
  estimate.covariance = 1e-4 * Matrix6::Identity();
  estimate.covariance(4, 4) = sigma_m * sigma_m;
  return estimate;
}

TEST(JudgeCovariance, LargeSigmasAreUncertainOrLost) {
  EXPECT_EQ(judge_covariance(with_sigma(0.49)).health, Health::good);
  EXPECT_EQ(judge_covariance(with_sigma(0.49)).reason, HealthReason::none);
  EXPECT_EQ(judge_covariance(with_sigma(0.51)).health, Health::uncertain);
  EXPECT_EQ(judge_covariance(with_sigma(0.51)).reason, HealthReason::covariance);
  EXPECT_EQ(judge_covariance(with_sigma(2.9)).health, Health::uncertain);
  EXPECT_EQ(judge_covariance(with_sigma(3.1)).health, Health::lost);
  EXPECT_EQ(judge_covariance(with_sigma(3.1)).reason, HealthReason::covariance);
}

TEST(JudgeCovariance, NumbersThatAreNotFiniteAreLost) {
  for (const double none : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Estimate position = with_sigma(0.1);
    position.state.T_map_imu.position.y() = none;
    Estimate covariance;
    covariance.covariance.setConstant(none);
    for (const Estimate& estimate : {position, covariance}) {
      EXPECT_EQ(judge_covariance(estimate).health, Health::lost);
      EXPECT_EQ(judge_covariance(estimate).reason, HealthReason::not_finite);
    }
  }
}

/// Floor and walls of a room of 12 m x 7 m with a partition.
std::vector<Eigen::Vector3f> room() {
  std::vector<Eigen::Vector3f> points;
  const auto wall = [&](const Vector3& from, const Vector3& to) {
    const double length_m = (to - from).norm();
    for (double s = 0.0; s < length_m; s += 0.05) {
      for (double z = 0.02; z < 2.5; z += 0.05) {
        Vector3 point = from + s / length_m * (to - from);
        point.z() = z;
        points.push_back(point.cast<float>());
      }
    }
  };
  wall({-6.02, -3.02, 0.0}, {6.02, -3.02, 0.0});
  wall({-6.02, 4.02, 0.0}, {6.02, 4.02, 0.0});
  wall({-6.02, -3.02, 0.0}, {-6.02, 4.02, 0.0});
  wall({6.02, -3.02, 0.0}, {6.02, 4.02, 0.0});
  wall({2.02, 1.0, 0.0}, {2.02, 4.0, 0.0});
  for (double x = -6.0; x < 6.0; x += 0.05) {
    for (double y = -3.0; y < 4.0; y += 0.05) points.emplace_back(x, y, 0.02);
  }
  return points;
}

/// Judges scans without points and readings: the diagnostics of each estimate are given.
class MonitorOfReadings : public ::testing::Test {
 protected:
  /// The next scan of an estimate with a small covariance.
  Estimate step(HealthMonitor& monitor, int samples, double weight, int unobserved_directions = 0) {
    Estimate estimate = with_sigma(0.01);
    estimate.time = from_seconds(kStep_s * ++steps_);
    estimate.diagnostics.magnetic_samples = samples;
    estimate.diagnostics.magnetic_weight = weight;
    estimate.diagnostics.unobserved_directions = unobserved_directions;
    estimate.diagnostics.correspondences = correspondences_;
    ScanBundle bundle;
    bundle.scan.end = estimate.time;
    if (correspondences_ > 0) bundle.scan.points.resize(1);
    bundle.imu_gap_s = imu_gap_s_;
    monitor.judge(bundle, estimate);
    return estimate;
  }
  Health health(HealthMonitor& monitor, int samples, double weight) { return step(monitor, samples, weight).health; }

  int steps_ = 0;
  int correspondences_ = 0;
  double imu_gap_s_ = 0.005;
};

TEST_F(MonitorOfReadings, NeedsSecondsOfDisagreementAndComesBack) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  while (steps_ < 100 && health(monitor, 4, 0.1) == Health::good) {
  }
  EXPECT_NEAR(steps_, 26, 1);  // 3 s · ln(0.9 / 0.4); the first scan has no step before it
  EXPECT_EQ(step(monitor, 4, 0.1).reason, HealthReason::field_off_map);
  // Off the map, the verdict does not change.
  for (int i = 0; i < 100; ++i) EXPECT_EQ(health(monitor, 0, 0.0), Health::lost);
  for (int i = 0; i < 10; ++i) health(monitor, 4, 1.0);
  EXPECT_EQ(health(monitor, 4, 1.0), Health::good);
}

TEST_F(MonitorOfReadings, ADirectionThatNothingObservesIsUnknownAfterSeconds) {
  EstimatorInput input;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  correspondences_ = 500;
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  // ½ · 0.02 m/s² · t² exceeds 0.5 m after 7.1 s and 3 m after 17.3 s.
  while (step(monitor, 0, 0.0, 1).health == Health::good) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 7.1, 0.25);
  while (step(monitor, 0, 0.0, 1).health == Health::uncertain) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 17.3, 0.25);
  EXPECT_EQ(step(monitor, 0, 0.0, 1).reason, HealthReason::unobserved);
  EXPECT_EQ(step(monitor, 0, 0.0, 0).health, Health::good);  // a scan that observes all directions
}

TEST_F(MonitorOfReadings, WithoutAnySensorAnEstimateIsLostAfterSeconds) {
  EstimatorInput input;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  imu_gap_s_ = 30.0;
  // ½ · 1 m/s² · t² exceeds 0.5 m after 1 s and 3 m after 2.4 s, also if the estimator sees no degenerate direction.
  while (step(monitor, 0, 0.0, 0).health == Health::good) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 1.0, 0.25);
  while (step(monitor, 0, 0.0, 0).health == Health::uncertain) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 2.4, 0.25);
  EXPECT_EQ(step(monitor, 0, 0.0, 0).reason, HealthReason::unobserved);
}

/// A filter that has left the field map, and has no scans, keeps a small covariance.
TEST_F(MonitorOfReadings, WithoutCloudMapNothingObservesAnEstimateOffTheFieldMap) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  for (int i = 0; i < 300; ++i) EXPECT_EQ(step(monitor, 4, 1.0).health, Health::good);
  while (step(monitor, 0, 0.0).health != Health::lost) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * (steps_ - 300), 17.3, 0.25);
  EXPECT_EQ(step(monitor, 0, 0.0).reason, HealthReason::unobserved);
}

TEST_F(MonitorOfReadings, ADirectionThatReadingsOrAGrowingCovarianceCoverIsNotUnknown) {
  const EstimatorInput input;
  correspondences_ = 500;
  HealthMonitor with_readings(input, Reckoning::calibrated_imu);
  for (int i = 0; i < 300; ++i) EXPECT_EQ(step(with_readings, 4, 1.0, 1).health, Health::good);
  HealthMonitor honest(input, Reckoning::calibrated_imu);
  for (int i = 1; i <= 100; ++i) {
    Estimate estimate = with_sigma(0.003 * i);  // 0.3 m after 10 s; dead reckoning says 1 m
    estimate.time = from_seconds(kStep_s * i);
    estimate.diagnostics.unobserved_directions = 1;
    ScanBundle bundle;
    bundle.scan.end = estimate.time;
    honest.judge(bundle, estimate);
    EXPECT_EQ(estimate.health, Health::good) << i;
  }
}

TEST_F(MonitorOfReadings, OfANewEstimatorBeginsWithoutDisagreement) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  for (int i = 0; i < 40; ++i) health(monitor, 4, 0.1);
  EXPECT_EQ(health(monitor, 4, 0.1), Health::lost);
  monitor.restart();
  EXPECT_EQ(health(monitor, 4, 0.1), Health::good);
}

TEST_F(MonitorOfReadings, JudgesARefinedEstimateByTheEvidenceOfItsTime) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  const Estimate before = step(monitor, 4, 1.0);
  const Estimate first = step(monitor, 4, 0.1);
  EXPECT_EQ(first.health, Health::good);
  for (int i = 0; i < 40; ++i) health(monitor, 4, 0.1);
  Estimate last = step(monitor, 4, 0.1);
  EXPECT_EQ(monitor.judge_refined(before).health, Health::good);
  EXPECT_EQ(monitor.judge_refined(first).health, Health::lost);  // the first of the scans that showed the loss
  EXPECT_EQ(monitor.judge_refined(last).health, Health::lost);
  EXPECT_EQ(monitor.judge_refined(last).reason, HealthReason::field_off_map);
  last.time += 1;
  EXPECT_EQ(monitor.judge_refined(last).health, Health::good);
  last.covariance(4, 4) = 1.0;
  EXPECT_EQ(monitor.judge_refined(last).health, Health::uncertain);
}

TEST_F(MonitorOfReadings, IsOnlyUncertainWhereLidarObservesEveryDirection) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  correspondences_ = 1000;
  for (int i = 0; i < 100; ++i) EXPECT_NE(step(monitor, 4, 0.1, 0).health, Health::lost);
  EXPECT_EQ(step(monitor, 4, 0.1, 0).health, Health::uncertain);
  EXPECT_EQ(step(monitor, 4, 0.1, 0).reason, HealthReason::field_off_map);
  for (int i = 0; i < 25; ++i) step(monitor, 4, 0.1, 1);
  EXPECT_EQ(step(monitor, 4, 0.1, 1).health, Health::lost);
}

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
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
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

/// A magnetic map that has changed over some metres is no reason to give up a pose that readings have just confirmed;
/// after seven seconds, dead reckoning tells no more than half a metre. `until_lost_s`: of readings that contradict.
double until_lost_s(const Eigen::Vector2d& offset_m) {
  EstimatorInput input = drive_of_nine_metres().room.input;
  input.field = moved_field(*input.field, offset_m);
  HealthMonitor monitor(input, Reckoning::calibrated_imu);
  Estimate estimate;
  for (const ScanBundle& bundle : drive_of_nine_metres().bundles) {
    estimate = true_estimate(bundle);
    monitor.judge(bundle, estimate);
  }
  EXPECT_EQ(estimate.health, Health::good);
  EXPECT_EQ(monitor.is_confirmed(), offset_m.isZero());
  const Time begin = estimate.time;
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

Pose in_room(double x, double y, double yaw_rad) {
  return {Quaternion(Eigen::AngleAxisd(yaw_rad, Vector3::UnitZ())), {x, y, 0.5}};
}

ImuSample at_rest(Time time) {
  return {time, Vector3::Zero(), {0.0, 0.0, 9.80665}};
}

class MonitorOfScans : public ::testing::Test {
 protected:
  MonitorOfScans() { input_.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{}); }

  /// The verdict after two seconds of a robot at rest at `actual`, of which the first `share` of points are measured
  /// and the others come from an object that surrounds the LiDAR.
  Verdict verdict(const Pose& actual, const Pose& estimated, double share = 1.0) {
    ScanBundle bundle;
    const std::vector<Eigen::Vector3f> points = room();
    const Pose inverse = actual.inverse();
    for (std::size_t i = 0; i < points.size(); i += 7) {
      LidarPoint point;
      point.position = (inverse * points[i].cast<double>()).cast<float>();
      if (static_cast<double>(i % 700) >= 700.0 * share) point.position *= 0.9F / point.position.norm();
      bundle.scan.points.push_back(point);
    }
    HealthMonitor monitor(input_, Reckoning::calibrated_imu);
    Estimate estimate = with_sigma(0.01);
    estimate.state.T_map_imu = estimated;
    for (int i = 1; i <= 20; ++i) {
      estimate.time = from_seconds(kStep_s * i);
      bundle.scan.start = estimate.time;
      bundle.scan.end = estimate.time;
      bundle.imu = {at_rest(estimate.time - from_seconds(kStep_s)), at_rest(estimate.time)};
      monitor.judge(bundle, estimate);
    }
    return {estimate.health, estimate.reason};
  }

  EstimatorInput input_;
};

TEST_F(MonitorOfScans, ScansThatFitAreGood) {
  EXPECT_EQ(verdict(in_room(-2.0, 1.0, 0.3), in_room(-2.0, 1.0, 0.3)).health, Health::good);
  EXPECT_EQ(verdict(in_room(4.0, 2.0, 2.0), in_room(4.0, 2.0, 2.0)).health, Health::good);
  EXPECT_EQ(verdict(in_room(4.0, 2.0, 2.0), in_room(4.0, 2.0, 2.0), 0.75).health, Health::good);
}

TEST_F(MonitorOfScans, ScansThatDoNotFitAreLost) {
  for (const Pose& wrong : {in_room(0.0, -1.0, 0.3), in_room(-2.0, 1.0, 1.3), in_room(30.0, 1.0, 0.3)}) {
    const Verdict result = verdict(in_room(-2.0, 1.0, 0.3), wrong);
    EXPECT_EQ(result.health, Health::lost) << wrong.position.transpose();
    EXPECT_EQ(result.reason, HealthReason::scan_off_map);
  }
}

TEST_F(MonitorOfScans, TheEstimatedPoseOfTheScanIsJudged) {
  // The estimator found that the LiDAR is mounted half a metre beside the platform file's position.
  HealthMonitor monitor(input_, Reckoning::calibrated_imu);
  ScanBundle bundle;
  const Pose actual = in_room(-2.0, 1.0, 0.3);
  for (const Eigen::Vector3f& point : room()) {
    LidarPoint measured;
    measured.position = (actual.inverse() * point.cast<double>()).cast<float>();
    bundle.scan.points.push_back(measured);
  }
  bundle.imu = {at_rest(-from_seconds(kStep_s)), at_rest(0)};
  Estimate estimate = with_sigma(0.01);
  estimate.state.T_map_imu = in_room(-2.0, 0.5, 0.8);
  estimate.scan_pose = actual;
  monitor.judge(bundle, estimate);
  EXPECT_EQ(estimate.health, Health::good);
  EXPECT_GT(estimate.diagnostics.place_share, 0.95);
}

}  // namespace
}  // namespace lodestone
