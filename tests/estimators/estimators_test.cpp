#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <iterator>

#include "core/error.h"
#include "estimators/smoother/smoother.h"
#include "tests/estimators/drive.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone::testing {
namespace {

TEST(Estimators, UnknownNamesAndMissingMapsAreOneClearLine) {
  EstimatorInput input;
  try {
    make_estimator("smoother", input);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--cloud"), std::string::npos);
  }
  input.field = shared_drive().field;
  for (const char* lidar : {"lidar-inertial", "ndt", "continuous-time"}) {
    EXPECT_THROW(make_estimator(lidar, input), InputError) << lidar;
  }
  for (const char* magnetic :
       {"magnetic", "magnetic-calibrating", "magnetic-mixture", "magnetic-particle", "magnetic-stochastic"}) {
    EXPECT_THAT(message_of<InputError>([&] { make_estimator(magnetic, input); }),
                ::testing::HasSubstr("requires magnetometers"));
  }
  try {
    make_estimator("smother", input);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'smoother'"), std::string::npos);
  }
}

TEST(Estimators, OfLidarAloneNeverSeeTheFieldMap) {
  const Drive& drive = shared_drive();
  EstimatorInput without = drive.input();
  without.field = nullptr;
  const Collector expected = run("lidar-inertial", without, drive.bundles);
  const Collector found = run("lidar-inertial", drive.input(), drive.bundles);
  ASSERT_EQ(found.best_estimates.size(), expected.best_estimates.size());
  for (std::size_t i = 0; i < expected.best_estimates.size(); ++i) {
    EXPECT_EQ(found.best_estimates[i].state.T_map_imu.position, expected.best_estimates[i].state.T_map_imu.position);
    EXPECT_EQ(found.best_estimates[i].diagnostics.field_odds, 0.0);  // nor does their health
  }
}

TEST(Smoother, IsCloseToTheTruthInATunnelAndKnowsHowClose) {
  const Drive& drive = shared_drive();
  // Exact calibration, as in the drive: the usual sigmas would make the covariance larger than the errors.
  EstimatorInput input = drive.input();
  input.suite.calibration = exact_calibration();
  const Collector result = run("smoother", input, drive.bundles);
  ASSERT_EQ(result.best_estimates.size(), drive.bundles.size());
  ASSERT_EQ(result.causal_estimates.size(), drive.bundles.size());
  const Accuracy best = accuracy(result.best_estimates, drive.truth);
  EXPECT_LT(best.max_m, 0.05);
  EXPECT_GT(best.nees, 0.4);
  EXPECT_LT(best.nees, 2.0);
  for (std::size_t i = 0; i < drive.bundles.size(); ++i) {
    EXPECT_EQ(result.best_estimates[i].time, drive.bundles[i].scan.end);
    EXPECT_EQ(result.best_estimates[i].diagnostics.degenerate_directions, 1) << i;
  }
}

TEST(Smoother, IsNoWorseThanTheFilterAndItsSmoothedOutputNoWorseThanItsCausal) {
  const Drive& drive = shared_drive();
  const Collector smoother = run("smoother", drive.input(), drive.bundles);
  const Collector filter = run("ieskf", drive.input(), drive.bundles);
  const double smoothed = accuracy(smoother.best_estimates, drive.truth).ate_m;
  EXPECT_LE(smoothed, accuracy(filter.best_estimates, drive.truth).ate_m);
  EXPECT_LE(smoothed, accuracy(smoother.causal_estimates, drive.truth).ate_m);
  EXPECT_LT(accuracy(filter.best_estimates, drive.truth).max_m, 0.1);
}

// A step that associates or solves again without need takes twice as long (docs/design/064-one-solve-a-step.md). In a
// tunnel the gate is wide along the axis: motion within the scan waits for a second association.
TEST(Smoother, SolvesAtMostTwiceAScanWhereThePredictionIsGood) {
  const Drive& drive = shared_drive();
  const Collector result = run("smoother", drive.input(), drive.bundles);
  constexpr std::ptrdiff_t kStart = 10;
  ASSERT_GT(std::ssize(result.causal_estimates), 2 * kStart);
  const auto quick = std::count_if(result.causal_estimates.begin() + kStart, result.causal_estimates.end(),
                                   [](const Estimate& estimate) { return estimate.diagnostics.iterations <= 2; });
  EXPECT_GT(static_cast<double>(quick), 0.8 * static_cast<double>(std::ssize(result.causal_estimates) - kStart));
}

// Cars stand where the map has none: within a wide gate their points are associated to floor and walls. With the gate
// of the initial 0.1 m and 1°, the first height was 26 sigmas off.
TEST(Smoother, ARoughStartAmongClutterEndsAsOneThatIsKnown) {
  const Drive drive = world_drive("carpark", "10", 1.0, 1);
  const Collector result = run("smoother", drive.input(), drive.bundles);
  for (const auto* estimates : {&result.causal_estimates, &result.best_estimates}) {
    const std::vector<Estimate> first(estimates->begin(), estimates->begin() + 2);
    EXPECT_LT(accuracy(first, drive.truth).nees, 4.0);
    EXPECT_LT(accuracy(first, drive.truth).max_m, 0.005);
  }
}

TEST(Smoother, WithoutMagnetometersATunnelsAxisStaysUnknown) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  input.field = nullptr;
  const Collector result = run("smoother", input, drive.bundles);
  double largest_sigma_m = 0.0;
  for (std::size_t i = 30; i < result.causal_estimates.size(); i += 10) {
    const Estimate& estimate = result.causal_estimates[i];
    // The bore is along x here, slightly curved. Only the IMU observes the position along it: its sigma grows, and the
    // error stays within it. All other directions stay well observed.
    const auto truth = interpolate(drive.truth, estimate.time, 20'000'000);
    const Matrix3 covariance = estimate.covariance.block<3, 3>(3, 3);
    const Eigen::SelfAdjointEigenSolver<Matrix3> axes(covariance);
    const double sigma_m = std::sqrt(axes.eigenvalues()[2]);
    EXPECT_GT(sigma_m, 0.4) << i;
    EXPECT_GT(sigma_m, 0.98 * largest_sigma_m) << i;
    largest_sigma_m = std::max(largest_sigma_m, sigma_m);
    EXPECT_LT(std::sqrt(axes.eigenvalues()[1]), 0.01) << i;
    EXPECT_GT(std::abs(axes.eigenvectors()(0, 2)), 0.98) << i;
    EXPECT_LT((estimate.state.T_map_imu.position - truth->position).norm(), 3.0 * sigma_m) << i;
    EXPECT_LT(std::abs(estimate.state.T_map_imu.position.z() - truth->position.z()), 0.02) << i;
  }
  EXPECT_GT(largest_sigma_m, 5.0);
}

TEST(Smoother, MagnetometersAndImuAloneHoldThePose) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  input.planes = nullptr;
  const Collector result = run("smoother", input, drive.bundles);
  EXPECT_LT(accuracy(result.best_estimates, drive.truth).max_m, 0.3);
}

TEST(Magnetic, HoldsThePoseWithoutLidarAndKnowsHowClose) {
  const Drive& drive = shared_drive();
  const Collector result = run("magnetic", drive.input(), drive.bundles);
  ASSERT_EQ(result.best_estimates.size(), drive.bundles.size());
  const Accuracy best = accuracy(result.best_estimates, drive.truth);
  EXPECT_LT(best.max_m, 0.1);
  EXPECT_GT(best.nees, 0.1);
  EXPECT_LT(best.nees, 2.0);
  for (const Estimate& estimate : result.best_estimates) EXPECT_EQ(estimate.health, Health::good);
}

TEST(Magnetic, TakesNothingFromCloudMapAndScans) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  const Collector with = run("magnetic", input, drive.bundles, 60);
  input.planes = nullptr;
  std::vector<ScanBundle> bundles = drive.bundles;
  for (ScanBundle& bundle : bundles) bundle.scan.points.clear();
  const Collector without = run("magnetic", input, bundles, 60);
  for (std::size_t i = 0; i < 60; ++i) {
    ASSERT_EQ(with.best_estimates[i].state.T_map_imu.position, without.best_estimates[i].state.T_map_imu.position) << i;
    ASSERT_EQ(with.best_estimates[i].covariance, without.best_estimates[i].covariance) << i;
  }
  input.field = nullptr;
  EXPECT_THROW(make_estimator("magnetic", input), InputError);
}

// The height is that of the layer: whatever the map says of its height is the error of every scan.
TEST(Estimators, WithoutCloudMapKnowTheHeightNoBetterThanTheLayer) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  input.planes = nullptr;
  const MagneticMap& map = *drive.field;
  ASSERT_EQ(map.grid().heights_m.size(), 1);
  const auto with_sigma = [&](double sigma_m) {
    FieldMapErrors errors = map.errors();
    errors.height_sigma_m = sigma_m;
    return std::make_shared<MagneticMap>(map.grid(), map.nodes(), map.max_sigma_ut(), errors);
  };
  for (const char* name : {"smoother", "magnetic", "magnetic-mixture", "magnetic-stochastic"}) {
    input.field = with_sigma(0.0);
    const Collector level = run(name, input, drive.bundles, 20);
    for (const double sigma_m : {0.03, -1.0}) {
      input.field = with_sigma(sigma_m);
      const Collector uneven = run(name, input, drive.bundles, 20);
      const double usual_m = sigma_m < 0.0 ? 0.02 : sigma_m;
      for (std::size_t i = 0; i < 20; ++i) {
        EXPECT_EQ(uneven.best_estimates[i].state.T_map_imu.position, level.best_estimates[i].state.T_map_imu.position);
        Matrix6 added = uneven.best_estimates[i].covariance - level.best_estimates[i].covariance;
        EXPECT_NEAR(added(5, 5), usual_m * usual_m, 1e-12) << name << " " << i;
        added(5, 5) = 0.0;
        EXPECT_EQ(added, Matrix6::Zero()) << name << " " << i;
        EXPECT_GE(uneven.causal_estimates[i].covariance(5, 5), usual_m * usual_m) << name << " " << i;
      }
    }
  }
}

TEST(Magnetic, SaysThatItIsLostWhereFieldAndMapDisagree) {
  const Drive& drive = shared_drive();
  for (const std::string name : {"magnetic", "smoother"}) {
    EstimatorInput input = drive.input();
    input.planes = nullptr;
    // A wrong initial heading: the steel below the robot is not that of the map.
    input.initial_pose.rotation = input.initial_pose.rotation * so3::exp(Vector3(0.0, 0.0, 2.0));
    const Collector result = run(name, input, drive.bundles);
    EXPECT_EQ(result.causal_estimates.back().health, Health::lost) << name;
    EXPECT_EQ(result.best_estimates.back().health, Health::lost) << name;
  }
}

TEST(Smoother, BridgesAnOutageOfTheLidar) {
  const Drive& drive = shared_drive();
  std::vector<ScanBundle> bundles = drive.bundles;
  for (std::size_t i = 100; i < 120; ++i) bundles[i].scan.points.clear();
  const Collector result = run("smoother", drive.input(), bundles);
  EXPECT_LT(accuracy(result.best_estimates, drive.truth).max_m, 0.1);
}

// Scans that become ten times as long: the lag must not.
TEST(Smoother, TheLagStaysBelowTwiceTheWindowWhenScansBecomeLonger) {
  constexpr double kWindow_s = 0.5;
  const Drive& drive = shared_drive();
  std::vector<ScanBundle> bundles(drive.bundles.begin(), drive.bundles.begin() + 20);
  for (std::size_t first = 20; first + 10 <= 120; first += 10) {
    ScanBundle joined = drive.bundles[first];
    for (std::size_t i = first + 1; i < first + 10; ++i) {
      const ScanBundle& part = drive.bundles[i];
      joined.scan = part.scan;
      joined.imu.insert(joined.imu.end(), part.imu.begin() + 1, part.imu.end());
      joined.magnetic.insert(joined.magnetic.end(), part.magnetic.begin(), part.magnetic.end());
    }
    bundles.push_back(std::move(joined));
  }
  EstimatorInput input = drive.input();
  input.options.smoother.window_s = kWindow_s;
  Smoother smoother(input);
  Collector collector;
  for (const ScanBundle& bundle : bundles) smoother.process(bundle, collector);
  EXPECT_LE(to_seconds(bundles.back().scan.end - collector.best_estimates.back().time), 2.0 * kWindow_s + 1e-6);
  smoother.finish(collector);
  ASSERT_EQ(collector.best_estimates.size(), bundles.size());
  for (std::size_t i = 0; i < bundles.size(); ++i) EXPECT_EQ(collector.best_estimates[i].time, bundles[i].scan.end);
}

TEST(Estimators, GiveTheSameBitsOnOneAndTwoThreadsAndOnTwoRuns) {
  const Drive& drive = shared_drive();
  for (const std::string& name : estimator_names()) {
    if (needs_scan_matcher(name)) continue;  // NdtInARoom compares its bits
    std::vector<Collector> results;
    for (int threads : {1, 2, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
      results.push_back(run(name, drive.input(), drive.bundles, 60));
    }
    for (std::size_t other : {1U, 2U}) {
      ASSERT_EQ(results[0].best_estimates.size(), results[other].best_estimates.size());
      for (std::size_t i = 0; i < results[0].best_estimates.size(); ++i) {
        const Estimate& a = results[0].best_estimates[i];
        const Estimate& b = results[other].best_estimates[i];
        ASSERT_EQ(a.state.T_map_imu.position, b.state.T_map_imu.position) << name << " " << i;
        ASSERT_EQ(a.state.T_map_imu.rotation.coeffs(), b.state.T_map_imu.rotation.coeffs()) << name << " " << i;
        ASSERT_EQ(a.covariance, b.covariance) << name << " " << i;
      }
    }
  }
}

struct Switch {
  std::string name;
  void (*set)(RunOptions&);
  friend void PrintTo(const Switch& self, std::ostream* stream) { *stream << self.name; }
};

class AblationTest : public ::testing::TestWithParam<Switch> {};

TEST_P(AblationTest, EverySwitchStillLocalizes) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  GetParam().set(input.options);
  const Collector changed = run("smoother", input, drive.bundles, 70);
  EXPECT_LT(accuracy(changed.best_estimates, drive.truth).max_m, 0.15);
  static const Collector standard = run("smoother", drive.input(), drive.bundles, 70);
  double difference = 0.0;
  for (std::size_t i = 0; i < 70; ++i) {
    difference += changed.best_estimates[i].state.T_map_imu.boxminus(standard.best_estimates[i].state.T_map_imu).norm();
  }
  EXPECT_GT(difference, 0.0) << "the switch does nothing";
}

INSTANTIATE_TEST_SUITE_P(
    Switches, AblationTest,
    ::testing::Values(
        Switch{"NoMask", [](RunOptions& options) { options.degeneracy.rule = DegeneracyRule::none; }},
        // With the field down-weighted, because both rules mask the same direction here.
        Switch{"PaperMask",
               [](RunOptions& options) {
                 options.degeneracy.rule = DegeneracyRule::paper;
                 options.degeneracy.mask = MaskKind::soft;
               }},
        Switch{"ProbabilisticMask",
               [](RunOptions& options) {
                 options.degeneracy.rule = DegeneracyRule::probabilistic;
                 options.degeneracy.mask = MaskKind::soft;
               }},
        Switch{"SoftMask", [](RunOptions& options) { options.degeneracy.mask = MaskKind::soft; }},
        Switch{"Huber", [](RunOptions& options) { options.magnetic.huber_probability = 0.2; }},
        Switch{"Beta",
               [](RunOptions& options) {
                 options.degeneracy.max_sigma_m = 1e6;  // never degenerate: β applies
                 options.magnetic.beta = 0.5;
               }},
        Switch{"NoShrink",
               [](RunOptions& options) {
                 options.degeneracy.max_sigma_m = 1e6;
                 options.magnetic.shrink = MagneticShrink::none;
               }},
        Switch{"Bilinear", [](RunOptions& options) { options.magnetic.interpolation = FieldInterpolation::bilinear; }},
        Switch{"NoMapSigma", [](RunOptions& options) { options.magnetic.map_sigma = false; }},
        Switch{"NoBiasStates", [](RunOptions& options) { options.smoother.solver.magnetometer_bias_states = false; }},
        Switch{"FieldPoses", [](RunOptions& options) { options.magnetic.measurement = MagneticMeasurement::pose; }},
        Switch{"ShortWindow", [](RunOptions& options) { options.smoother.window_s = 0.5; }},
        Switch{"OneResidualAPoint", [](RunOptions& options) { options.smoother.solver.condensed = false; }}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace lodestone::testing
