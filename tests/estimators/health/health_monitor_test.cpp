#include "estimators/health/health_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/angles.h"
#include "core/lidar/plane_map.h"
#include "tests/estimators/health/estimates.h"

namespace lodestone {
namespace {

using testing::kStep_s;
using testing::with_sigma;

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
  MonitorOfReadings() {
    mounted_.suite.calibration = exact_calibration();
    mounted_.options.initial.velocity_sigma_m_s = 1e-9;
  }

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

  EstimatorInput mounted_;  // with a LiDAR mounted as the platform file says, and a known initial velocity
  int steps_ = 0;
  int correspondences_ = 0;
  double imu_gap_s_ = 0.005;
};

TEST_F(MonitorOfReadings, NeedsSecondsOfDisagreementAndComesBack) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::learned_imu);
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
  EstimatorInput input = mounted_;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  correspondences_ = 500;
  HealthMonitor monitor(input, Reckoning::learned_imu);
  // ½ · 0.02 m/s² · t² exceeds 0.5 m after 7.1 s and 3 m after 17.3 s.
  while (step(monitor, 0, 0.0, 1).health == Health::good) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 7.1, 0.25);
  while (step(monitor, 0, 0.0, 1).health == Health::uncertain) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 17.3, 0.25);
  EXPECT_EQ(step(monitor, 0, 0.0, 1).reason, HealthReason::unobserved);
  // Scans that observe all directions do not say that this is the place: it may be one that looks alike.
  for (int i = 0; i < 100; ++i) EXPECT_EQ(step(monitor, 0, 0.0, 0).reason, HealthReason::unobserved);
  monitor.restart();
  EXPECT_EQ(step(monitor, 0, 0.0, 0).health, Health::good);
}

/// Along such a direction an estimator is as far off as what carries it: an IMU that the scans hold at the tilt of a
/// wrong mounting, until it has learned, or the scans' own noise.
TEST_F(MonitorOfReadings, DeadReckoningIsAsGoodAsWhatCarriesIt) {
  EstimatorInput input;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  correspondences_ = 500;
  for (const double tilt_deg : {0.0, 0.3, 1.0}) {
    input.suite.calibration.lidar.rotation_sigma_deg = tilt_deg;
    const double mounted_m_s2 = std::hypot(0.02, input.suite.gravity_m_s2 * tilt_deg * degree);
    struct Case {
      Reckoning reckoning;
      double observed_s;
      double acceleration_m_s2;
    };
    for (const Case& c : {Case{Reckoning::learned_imu, 6.0, 0.02}, Case{Reckoning::learned_imu, 4.0, mounted_m_s2},
                          Case{Reckoning::mounted_imu, 6.0, mounted_m_s2}, Case{Reckoning::scans, 6.0, 1.0}}) {
      HealthMonitor monitor(input, c.reckoning);
      for (steps_ = 0; kStep_s * steps_ < c.observed_s;) step(monitor, 0, 0.0, 0);
      const int begin = steps_;
      while (step(monitor, 0, 0.0, 1).health == Health::good) ASSERT_LT(steps_, 1000);
      EXPECT_NEAR(kStep_s * (steps_ - begin), std::sqrt(2.0 * 0.5 / c.acceleration_m_s2), 0.25);
      while (step(monitor, 0, 0.0, 1).health == Health::uncertain) ASSERT_LT(steps_, 1000);
      EXPECT_NEAR(kStep_s * (steps_ - begin), std::sqrt(2.0 * 3.0 / c.acceleration_m_s2), 0.25);
    }
  }
}

TEST_F(MonitorOfReadings, AnInitialVelocityThatNothingObservedIsUnknown) {
  EstimatorInput input = mounted_;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  input.options.initial.velocity_sigma_m_s = 0.5;
  correspondences_ = 500;
  HealthMonitor monitor(input, Reckoning::learned_imu);
  while (step(monitor, 0, 0.0, 1).health == Health::good) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 1.0, 0.25);
  while (step(monitor, 0, 0.0, 1).health == Health::uncertain) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * steps_, 5.4, 0.25);  // 0.5 m/s · t + ½ · 0.02 m/s² · t² is 3 m
}

/// Once the place is uncertain by more than half a metre, a few scans do not end the dead reckoning; a second does.
TEST_F(MonitorOfReadings, AFewScansDoNotEndALongDeadReckoning) {
  EstimatorInput input = mounted_;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  correspondences_ = 500;
  const auto health_after_two_stretches = [&](double stretch_s, double observed_s) {
    HealthMonitor monitor(input, Reckoning::learned_imu);
    Health health = Health::good;
    for (int i = 0; i < stretch_s / kStep_s; ++i) health = step(monitor, 0, 0.0, 1).health;
    for (int i = 0; i < observed_s / kStep_s; ++i) health = step(monitor, 0, 0.0, 0).health;
    for (int i = 0; i < stretch_s / kStep_s; ++i) health = step(monitor, 0, 0.0, 1).health;
    return health;
  };
  EXPECT_EQ(health_after_two_stretches(6.0, 0.2), Health::good);
  EXPECT_EQ(health_after_two_stretches(10.0, 0.5), Health::lost);
  EXPECT_EQ(health_after_two_stretches(10.0, 1.5), Health::uncertain);
}

TEST_F(MonitorOfReadings, WithoutAnySensorAnEstimateIsLostAfterSeconds) {
  EstimatorInput input = mounted_;
  input.planes = std::make_shared<PlaneMap>(room(), PlaneMapOptions{});
  HealthMonitor monitor(input, Reckoning::learned_imu);
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
  HealthMonitor monitor(input, Reckoning::learned_imu);
  for (int i = 0; i < 300; ++i) EXPECT_EQ(step(monitor, 4, 1.0).health, Health::good);
  while (step(monitor, 0, 0.0).health != Health::lost) ASSERT_LT(steps_, 1000);
  EXPECT_NEAR(kStep_s * (steps_ - 300), 17.3, 0.25);
  EXPECT_EQ(step(monitor, 0, 0.0).reason, HealthReason::unobserved);
}

TEST_F(MonitorOfReadings, ADirectionThatReadingsOrAGrowingCovarianceCoverIsNotUnknown) {
  const EstimatorInput input = mounted_;
  correspondences_ = 500;
  HealthMonitor with_readings(input, Reckoning::learned_imu);
  for (int i = 0; i < 300; ++i) EXPECT_EQ(step(with_readings, 4, 1.0, 1).health, Health::good);
  HealthMonitor honest(input, Reckoning::learned_imu);
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
  HealthMonitor monitor(input, Reckoning::learned_imu);
  for (int i = 0; i < 40; ++i) health(monitor, 4, 0.1);
  EXPECT_EQ(health(monitor, 4, 0.1), Health::lost);
  monitor.restart();
  EXPECT_EQ(health(monitor, 4, 0.1), Health::good);
}

TEST_F(MonitorOfReadings, JudgesARefinedEstimateByTheEvidenceOfItsTime) {
  const EstimatorInput input;
  HealthMonitor monitor(input, Reckoning::learned_imu);
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
  HealthMonitor monitor(input, Reckoning::learned_imu);
  correspondences_ = 1000;
  for (int i = 0; i < 100; ++i) EXPECT_NE(step(monitor, 4, 0.1, 0).health, Health::lost);
  EXPECT_EQ(step(monitor, 4, 0.1, 0).health, Health::uncertain);
  EXPECT_EQ(step(monitor, 4, 0.1, 0).reason, HealthReason::field_off_map);
  for (int i = 0; i < 25; ++i) step(monitor, 4, 0.1, 1);
  EXPECT_EQ(step(monitor, 4, 0.1, 1).health, Health::lost);
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
    HealthMonitor monitor(input_, Reckoning::learned_imu);
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

TEST_F(MonitorOfScans, PointsBeyondTheRangeSayNothing) {
  EXPECT_EQ(verdict(in_room(-2.0, 1.0, 0.3), in_room(0.0, -1.0, 0.3)).health, Health::lost);
  input_.suite.lidar.max_range_m = 2.0;
  EXPECT_EQ(verdict(in_room(-2.0, 1.0, 0.3), in_room(0.0, -1.0, 0.3)).health, Health::good);
}

/// People around the robot, 1.5 m apart from each other, where the map has nothing.
TEST_F(MonitorOfScans, AFewPointsSayNothing) {
  const auto with_people = [&](int people) {
    ScanBundle bundle;
    for (int i = 0; i < 200; ++i) {  // the floor
      bundle.scan.points.emplace_back().position = Eigen::Vector3f(0.02F * static_cast<float>(i) - 2.0F, 1.0F, -0.5F);
    }
    for (int i = 0; i < people; ++i) {
      const auto column = static_cast<float>(i % 4) - 1.5F;
      const auto row = static_cast<float>(i / 4 % 4) - 1.5F;
      bundle.scan.points.emplace_back().position =
          Eigen::Vector3f(1.1F * column + 0.1F, 1.1F * row + 0.1F, 0.3F + 1.1F * static_cast<float>(i / 16));
    }
    bundle.imu = {at_rest(-from_seconds(kStep_s)), at_rest(0)};
    HealthMonitor monitor(input_, Reckoning::learned_imu);
    Estimate estimate = with_sigma(0.01);
    estimate.state.T_map_imu = in_room(0.0, 0.0, 0.0);
    monitor.judge(bundle, estimate);
    return estimate;
  };
  EXPECT_EQ(with_people(40).health, Health::good);
  EXPECT_EQ(with_people(40).diagnostics.place_points, 0);
  EXPECT_EQ(with_people(80).health, Health::lost);
  EXPECT_GE(with_people(80).diagnostics.place_points, 60);
}

TEST_F(MonitorOfScans, TheEstimatedPoseOfTheScanIsJudged) {
  // The estimator found that the LiDAR is mounted half a metre beside the platform file's position.
  HealthMonitor monitor(input_, Reckoning::learned_imu);
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
