// Wheel odometry in the estimators: drives whose wheels measure the ground truth's velocity.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/random_stream.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

/// What the wheels of a drive report, beside their noise.
struct Wheels {
  double scale = 0.0;
  double slip = 0.0;  ///< from slip_begin_s to slip_end_s after the drive's begin
  double slip_begin_s = 0.0;
  double slip_end_s = 0.0;
};

constexpr double kNoise_m_s = 0.02;
constexpr Time kWheelPeriod = 50'000'000;

/// The drive with wheels at the IMU. Wheels that turn slower than 1 cm/s stand still.
Drive with_wheels(Drive drive, const Wheels& wheels) {
  drive.suite.wheels.emplace();
  drive.suite.wheels->velocity_sigma_m_s = kNoise_m_s;
  drive.suite.calibration.wheels = WheelCalibrationSigmas{};
  RandomStream random(5, "wheels of a test");
  const Time begin = drive.truth.front().time;
  constexpr Time kSide = 10'000'000;
  Time time = begin + kWheelPeriod;
  for (ScanBundle& bundle : drive.bundles) {
    for (; time <= bundle.scan.end; time += kWheelPeriod) {
      const auto before = interpolate(drive.truth, time - kSide, kWheelPeriod);
      const auto after = interpolate(drive.truth, time + kSide, kWheelPeriod);
      if (!before || !after) continue;
      const Vector3 moved = before->rotation.conjugate() * (after->position - before->position);
      double velocity_m_s = moved.x() / to_seconds(2 * kSide);
      const double seconds = to_seconds(time - begin);
      const double slip = seconds > wheels.slip_begin_s && seconds <= wheels.slip_end_s ? wheels.slip : 0.0;
      const bool stands = std::abs(velocity_m_s) < 0.01;
      velocity_m_s = stands ? 0.0 : (1.0 + wheels.scale + slip) * velocity_m_s + kNoise_m_s * random.normal();
      bundle.wheels.push_back({time, velocity_m_s, 0.0, 0.0});
    }
  }
  return drive;
}

EstimatorInput without_field(const Drive& drive) {
  EstimatorInput input = drive.input();
  input.field = nullptr;
  return input;
}

/// The largest sigma of the last causal position, and its error.
struct End {
  double sigma_m = 0.0;
  double error_m = 0.0;
};

End end_of(const Collector& result, const Trajectory& truth) {
  const Estimate& last = result.causal_estimates.back();
  const auto pose = interpolate(truth, last.time, 20'000'000);
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(Matrix3(last.covariance.bottomRightCorner<3, 3>()));
  return {std::sqrt(axes.eigenvalues()[2]), (last.state.T_map_imu.position - pose->position).norm()};
}

class OfEstimator : public ::testing::TestWithParam<const char*> {};

TEST_P(OfEstimator, WheelsKeepThePositionAlongATunnel) {
  const Drive drive = with_wheels(shared_drive(), {.scale = 0.005});
  EstimatorInput input = without_field(drive);
  const Collector with = run(GetParam(), input, drive.bundles);
  input.options.wheels.enabled = false;
  const Collector without = run(GetParam(), input, drive.bundles);
  EXPECT_LT(end_of(with, drive.truth).sigma_m, end_of(without, drive.truth).sigma_m);
  EXPECT_LT(accuracy(with.causal_estimates, drive.truth).ate_m, accuracy(without.causal_estimates, drive.truth).ate_m);
}

TEST_P(OfEstimator, DisabledWheelsChangeNoBit) {
  const Drive drive = with_wheels(shared_drive(), {.scale = 0.1});
  EstimatorInput input = drive.input();
  input.options.wheels.enabled = false;
  const Collector disabled = run(GetParam(), input, drive.bundles, 60);
  const Collector none = run(GetParam(), shared_drive().input(), shared_drive().bundles, 60);
  ASSERT_EQ(disabled.best_estimates.size(), none.best_estimates.size());
  for (std::size_t i = 0; i < none.best_estimates.size(); ++i) {
    ASSERT_EQ(disabled.best_estimates[i].state.T_map_imu.position, none.best_estimates[i].state.T_map_imu.position);
    ASSERT_EQ(disabled.best_estimates[i].state.velocity, none.best_estimates[i].state.velocity);
    ASSERT_EQ(disabled.best_estimates[i].covariance, none.best_estimates[i].covariance);
  }
  EXPECT_LT(disabled.causal_estimates.back().diagnostics.wheel_weight, 0.0);
}

TEST_P(OfEstimator, SlipOfFivePercentDoesNoHarmWhereMapsObserveThePosition) {
  const Drive slipping = with_wheels(shared_drive(), {.slip = 0.05, .slip_begin_s = 8.0, .slip_end_s = 13.0});
  const Collector with = run(GetParam(), slipping.input(), slipping.bundles);
  const Collector without = run(GetParam(), shared_drive().input(), shared_drive().bundles);
  const Accuracy slipped = accuracy(with.best_estimates, slipping.truth);
  EXPECT_LT(slipped.ate_m, 1.2 * accuracy(without.best_estimates, slipping.truth).ate_m + 0.002);
  EXPECT_LT(slipped.max_m, 0.1);
}

std::string estimator_name(const ::testing::TestParamInfo<const char*>& info) {
  return info.param;
}

INSTANTIATE_TEST_SUITE_P(Wheels, OfEstimator, ::testing::Values("smoother", "ieskf"), estimator_name);

TEST(Wheels, TheSmootherKnowsHowWellTheyKeepThePosition) {
  const Drive drive = with_wheels(shared_drive(), {.scale = 0.005});
  EstimatorInput input = without_field(drive);
  const End kept = end_of(run("smoother", input, drive.bundles), drive.truth);
  input.options.wheels.enabled = false;
  const End drifted = end_of(run("smoother", input, drive.bundles), drive.truth);
  EXPECT_LT(kept.sigma_m, 0.3 * drifted.sigma_m);
  EXPECT_LT(kept.error_m, 3.0 * kept.sigma_m);
}

TEST(Wheels, ADetectedSlipIsEstimatedAndWarnedOf) {
  const Drive drive = with_wheels(shared_drive(), {.slip = 0.2, .slip_begin_s = 10.0, .slip_end_s = 15.0});
  WarningLog warnings;
  EstimatorInput input = drive.input();
  input.warnings = &warnings;
  const Collector result = run("smoother", input, drive.bundles);
  const Time begin = drive.truth.front().time;
  double squared = 0.0;
  int count = 0;
  for (const Estimate& estimate : result.causal_estimates) {
    const double seconds = to_seconds(estimate.time - begin);
    if (seconds < 11.0 || seconds > 14.5) continue;
    squared += std::pow(estimate.diagnostics.wheel_slip - 0.2, 2);
    ++count;
  }
  ASSERT_GT(count, 20);
  EXPECT_LT(std::sqrt(squared / count), 0.05);
  EXPECT_GE(warnings.count("wheels.slip"), 1);
  EXPECT_THAT(warnings.entries().at("wheels.slip").first_detail, ::testing::HasSubstr("wheels.scale"));
  EXPECT_LT(accuracy(result.best_estimates, drive.truth).max_m, 0.1);
}

TEST(Wheels, GoodWheelsAreNotWarnedOf) {
  const Drive drive = with_wheels(shared_drive(), {.scale = 0.005});
  WarningLog warnings;
  EstimatorInput input = drive.input();
  input.warnings = &warnings;
  const Collector result = run("smoother", input, drive.bundles);
  EXPECT_EQ(warnings.count("wheels.slip"), 0);
  double mean_weight = 0.0;
  for (const Estimate& estimate : result.causal_estimates) {
    mean_weight += estimate.diagnostics.wheel_weight / static_cast<double>(result.causal_estimates.size());
  }
  EXPECT_GT(mean_weight, 0.9);
}

TEST(Wheels, TheirScaleIsEstimated) {
  const Drive drive = with_wheels(shared_drive(), {.scale = 0.03});
  EstimatorInput input = drive.input();
  input.suite.calibration.wheels.scale_sigma = 0.03;
  input.suite.calibration.wheels.slip_sigma = 0.002;
  Collector collector;
  const auto smoother = make_estimator("smoother", input);
  for (const ScanBundle& bundle : drive.bundles) smoother->process(bundle, collector);
  smoother->finish(collector);
  ASSERT_NE(smoother->calibration(), nullptr);
  const CalibrationEstimate::Wheels& wheels = smoother->calibration()->wheels;
  EXPECT_LT(wheels.scale_sigma, 0.01);
  EXPECT_LT(std::abs(wheels.correction.scale - 0.03), 3.0 * wheels.scale_sigma);
}

TEST(Wheels, TheBatchUsesThemToo) {
  const Drive drive = with_wheels(shared_drive(), {});
  EstimatorInput input = without_field(drive);
  input.options.smoother.refine = Refinement::batch;
  const Collector with = run("smoother", input, drive.bundles, 80);
  input.options.wheels.enabled = false;
  const Collector without = run("smoother", input, drive.bundles, 80);
  const double kept_m2 = with.best_estimates.back().covariance.diagonal().tail<3>().sum();
  const double drifted_m2 = without.best_estimates.back().covariance.diagonal().tail<3>().sum();
  EXPECT_LT(kept_m2, 0.2 * drifted_m2);
}

/// At rest without LiDAR and field, only the wheels know that the robot stands.
TEST(Wheels, ThatStandStillHoldTheVelocityAtZero) {
  Drive drive = shared_drive();
  drive.suite.wheels.emplace();
  const auto resting =
      static_cast<std::size_t>(std::count_if(drive.bundles.begin(), drive.bundles.end(), [&](const ScanBundle& bundle) {
        return to_seconds(bundle.scan.end - drive.bundles.front().scan.start) < 1.8;
      }));
  ASSERT_GE(resting, 10U);
  for (ScanBundle& bundle : drive.bundles) {
    bundle.scan.points.clear();
    bundle.wheels.push_back({bundle.scan.end, 0.0, 0.0, 0.0});
  }
  for (const char* name : {"smoother", "lidar-inertial"}) {
    EstimatorInput input = without_field(drive);
    const Collector with = run(name, input, drive.bundles, resting);
    input.options.wheels.enabled = false;
    const Collector without = run(name, input, drive.bundles, resting);
    EXPECT_LT(with.causal_estimates.back().state.velocity.norm(), 0.01) << name;
    EXPECT_LT(end_of(with, drive.truth).sigma_m, 0.5 * end_of(without, drive.truth).sigma_m) << name;
  }
}

}  // namespace
}  // namespace lodestone::testing
