#include "estimators/baselines/scan_degeneracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/estimators/drive.h"
#include "tests/estimators/room.h"

namespace lodestone::testing {
namespace {

Estimate truth_at(const ScanBundle& bundle, const Trajectory& truth) {
  Estimate estimate;
  NavState& state = estimate.state;
  state.T_map_imu = *interpolate(truth, bundle.scan.end, 20'000'000);
  const Pose before = *interpolate(truth, bundle.scan.start, 20'000'000);
  const double length_s = to_seconds(bundle.scan.end - bundle.scan.start);
  state.velocity = (state.T_map_imu.position - before.position) / length_s;
  estimate.covariance = 1e-4 * Matrix6::Identity();
  return estimate;
}

TEST(ScanDegeneracy, ATunnelLosesItsAxis) {
  const Drive& drive = shared_drive();
  for (std::size_t i = 10; i < drive.bundles.size(); i += 40) {
    const Degeneracy found = scan_degeneracy(drive.input(), drive.bundles[i], truth_at(drive.bundles[i], drive.truth));
    EXPECT_EQ(found.degenerate_directions, 1) << i;
    // The last direction is that without information: the bore is along x here.
    EXPECT_GT(std::abs(found.directions(3, 5)), 0.9) << i;
  }
}

TEST(ScanDegeneracy, ARoomLosesNothing) {
  const RoomDrive drive = drive_through_room(3, 2.0);
  for (const ScanBundle& bundle : drive.bundles) {
    EXPECT_EQ(scan_degeneracy(drive.room.input, bundle, truth_at(bundle, drive.truth)).degenerate_directions, 0);
  }
}

TEST(ScanDegeneracy, WithoutPointsAndFarFromTheMapNothingIsObserved) {
  const Drive& drive = shared_drive();
  ScanBundle empty = drive.bundles[10];
  const Estimate estimate = truth_at(empty, drive.truth);
  empty.scan.points.clear();
  EXPECT_EQ(scan_degeneracy(drive.input(), empty, estimate).degenerate_directions, 6);
  for (const double away_m : {1e12, std::nan("")}) {
    Estimate far = estimate;
    far.state.T_map_imu.position.x() = away_m;
    EXPECT_EQ(scan_degeneracy(drive.input(), drive.bundles[10], far).degenerate_directions, 6);
  }
}

// The search of the estimator without IMU finds a pose in every scan. Only this says what it does not observe.
TEST(ScanDegeneracy, IsInTheDiagnosticsOfABaseline) {
  const Drive& drive = shared_drive();
  const Collector result = run("continuous-time", drive.input(), drive.bundles, 20);
  for (const Estimate& estimate : result.causal_estimates) EXPECT_EQ(estimate.diagnostics.degenerate_directions, 1);
}

// Health compares what the scan observes with what the estimator believes, whatever rule it masks by.
TEST(ScanDegeneracy, WhatAScanObservesDoesNotDependOnTheRuleOfTheEstimator) {
  const Drive& drive = shared_drive();
  for (const char* name : {"ieskf", "smoother", "continuous-time"}) {
    EstimatorInput input = drive.input();
    input.options.ieskf.degeneracy.paper_threshold = 1e-9;
    input.options.degeneracy.rule = DegeneracyRule::none;
    const Collector result = run(name, input, drive.bundles, 10);
    ASSERT_FALSE(result.causal_estimates.empty());
    for (const Estimate& estimate : result.causal_estimates) {
      EXPECT_EQ(estimate.diagnostics.unobserved_directions, 1) << name;
      if (name != std::string("continuous-time")) {
        EXPECT_EQ(estimate.diagnostics.degenerate_directions, 0) << name;
      }
    }
  }
  const RoomDrive room = drive_through_room(3, 1.0);
  for (const char* name : {"ieskf", "smoother", "continuous-time"}) {
    for (const Estimate& estimate : run(name, room.room.input, room.bundles).causal_estimates) {
      EXPECT_EQ(estimate.diagnostics.unobserved_directions, 0) << name;
    }
  }
}

}  // namespace
}  // namespace lodestone::testing
