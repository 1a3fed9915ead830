#include "estimators/health/health_monitor.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/lidar/plane_map.h"

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

/// Judges scans without points and readings: the diagnostics of each estimate are given.
class MonitorOfReadings : public ::testing::Test {
 protected:
  /// The next scan of an estimate with a small covariance.
  Estimate step(HealthMonitor& monitor, int samples, double weight, int degenerate_directions = 0) {
    Estimate estimate = with_sigma(0.01);
    estimate.time = from_seconds(kStep_s * ++steps_);
    estimate.diagnostics.magnetic_samples = samples;
    estimate.diagnostics.magnetic_weight = weight;
    estimate.diagnostics.degenerate_directions = degenerate_directions;
    ScanBundle bundle;
    bundle.scan.end = estimate.time;
    monitor.judge(bundle, estimate);
    return estimate;
  }
  Health health(HealthMonitor& monitor, int samples, double weight) { return step(monitor, samples, weight).health; }

  int steps_ = 0;
};

TEST_F(MonitorOfReadings, NeedsSecondsOfDisagreementAndComesBack) {
  const EstimatorInput input;
  HealthMonitor monitor(input);
  while (steps_ < 100 && health(monitor, 4, 0.1) == Health::good) {
  }
  EXPECT_NEAR(steps_, 26, 1);  // 3 s · ln(0.9 / 0.4); the first scan has no step before it
  EXPECT_EQ(step(monitor, 4, 0.1).reason, HealthReason::field_off_map);
  // Off the map, the verdict does not change.
  for (int i = 0; i < 100; ++i) EXPECT_EQ(health(monitor, 0, 0.0), Health::lost);
  for (int i = 0; i < 10; ++i) health(monitor, 4, 1.0);
  EXPECT_EQ(health(monitor, 4, 1.0), Health::good);
}

TEST_F(MonitorOfReadings, OfANewEstimatorBeginsWithoutDisagreement) {
  const EstimatorInput input;
  HealthMonitor monitor(input);
  for (int i = 0; i < 40; ++i) health(monitor, 4, 0.1);
  EXPECT_EQ(health(monitor, 4, 0.1), Health::lost);
  monitor.restart();
  EXPECT_EQ(health(monitor, 4, 0.1), Health::good);
}

TEST_F(MonitorOfReadings, JudgesARefinedEstimateByTheEvidenceOfItsTime) {
  const EstimatorInput input;
  HealthMonitor monitor(input);
  const Estimate first = step(monitor, 4, 0.1);
  for (int i = 0; i < 40; ++i) health(monitor, 4, 0.1);
  Estimate last = step(monitor, 4, 0.1);
  EXPECT_EQ(monitor.judge_refined(first).health, Health::good);
  EXPECT_EQ(monitor.judge_refined(last).health, Health::lost);
  EXPECT_EQ(monitor.judge_refined(last).reason, HealthReason::field_off_map);
  last.time += 1;
  EXPECT_EQ(monitor.judge_refined(last).health, Health::good);
  last.covariance(4, 4) = 1.0;
  EXPECT_EQ(monitor.judge_refined(last).health, Health::uncertain);
}

TEST_F(MonitorOfReadings, IgnoresWeightsWhereLidarObservesEveryDirection) {
  std::vector<Eigen::Vector3f> floor;
  for (int i = 0; i < 400; ++i) {
    floor.emplace_back(0.05F * static_cast<float>(i % 20), 0.05F * static_cast<float>(i / 20), 0.125F);
  }
  EstimatorInput input;
  input.planes = std::make_shared<PlaneMap>(floor, PlaneMapOptions{});
  HealthMonitor monitor(input);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(step(monitor, 4, 0.1, 0).health, Health::good);
  while (steps_ < 200 && step(monitor, 4, 0.1, 1).health == Health::good) {
  }
  EXPECT_NEAR(steps_, 125, 1);
  EXPECT_EQ(step(monitor, 4, 0.1, 1).health, Health::lost);
  EXPECT_EQ(step(monitor, 4, 0.1, 0).health, Health::good);
}

}  // namespace
}  // namespace lodestone
