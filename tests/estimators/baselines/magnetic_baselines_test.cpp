// The sampled magnetic estimators: accuracy, consistency, several modes, determinism.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>

#include "core/error.h"
#include "estimators/baselines/magnetic_particle/magnetic_particle_filter.h"
#include "estimators/baselines/magnetic_stochastic/magnetic_stochastic_filter.h"
#include "tests/estimators/baselines/striped_field.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

class MagneticBaselines : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Names, MagneticBaselines,
                         ::testing::Values("magnetic-mixture", "magnetic-particle", "magnetic-stochastic"),
                         [](const auto& name) { return name.param.substr(std::strlen("magnetic-")); });

// The paper's figures are 0.12 to 0.2 m.
TEST_P(MagneticBaselines, IsAccurateInARichFieldAndKnowsHowAccurate) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  input.planes = nullptr;
  input.suite.calibration = exact_calibration();
  const Collector result = run(GetParam(), input, drive.bundles);
  ASSERT_EQ(result.best_estimates.size(), drive.bundles.size());
  const Accuracy best = accuracy(result.best_estimates, drive.truth);
  EXPECT_LT(best.ate_m, 0.1);
  EXPECT_GT(best.nees, 0.1);
  EXPECT_LT(best.nees, 3.0);
  for (const Estimate& estimate : result.best_estimates) EXPECT_EQ(estimate.health, Health::good);
}

TEST_P(MagneticBaselines, ErrorsOfManyDrivesHaveTheReportedCovariance) {
  const StripedField stripes;
  constexpr int kDrives = 12;
  double nees = 0.0;
  double squared_m2 = 0.0;
  double variance_m2 = 0.0;
  for (int seed = 0; seed < kDrives; ++seed) {
    EstimatorInput input = stripes.input;
    RandomStream random(static_cast<std::uint64_t>(seed), "initial pose");
    Vector6 offset = Vector6::Zero();
    offset[2] = input.options.initial.rotation_sigma_deg * M_PI / 180.0 * random.normal();
    offset[3] = input.options.initial.position_sigma_m * random.normal();
    offset[4] = input.options.initial.position_sigma_m * random.normal();
    input.initial_pose = input.initial_pose.boxplus(offset);
    const Collector result = run(GetParam(), input, stripes.drive(3.0, static_cast<std::uint64_t>(seed)));
    const Estimate& last = result.causal_estimates.back();
    const Vector6 error = last.state.T_map_imu.boxminus(StripedField::truth(last.time));
    // Heading, x and y: what the field observes.
    const Eigen::Vector3d seen = error.segment<3>(2);
    const Matrix3 covariance = last.covariance.block<3, 3>(2, 2);
    nees += seen.dot(covariance.inverse() * seen) / (3.0 * kDrives);
    squared_m2 += seen.tail<2>().squaredNorm() / kDrives;
    variance_m2 += covariance.diagonal().tail<2>().sum() / kDrives;
  }
  // χ² with 36 degrees of freedom over 36 is between 0.5 and 1.7 with a probability of 99 %. The errors of this map are
  // smaller than its sigma.
  EXPECT_GT(nees, 0.1);
  EXPECT_LT(nees, 1.7);
  EXPECT_LT(squared_m2, 0.06 * 0.06);
  EXPECT_LT(variance_m2, 0.1 * 0.1);
}

TEST_P(MagneticBaselines, GivesTheSameBitsOnAnyNumberOfThreads) {
  const StripedField stripes;
  const std::vector<ScanBundle> bundles = stripes.drive(1.5, 1);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return run(GetParam(), stripes.input, bundles).causal_estimates;
  };
  const std::vector<Estimate> one = with_threads(1);
  const std::vector<Estimate> two = with_threads(2);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(std::memcmp(one[i].covariance.data(), two[i].covariance.data(), sizeof(Matrix6)), 0) << i;
    EXPECT_TRUE(one[i].state.boxminus(two[i].state).isZero(0.0)) << i;
  }
}

TEST_P(MagneticBaselines, RequiresAFieldMapAndIgnoresTheCloudMap) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  input.field = nullptr;
  try {
    make_estimator(GetParam(), input);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--magnetic"), std::string::npos);
  }
  const Collector with = run(GetParam(), drive.input(), drive.bundles, 20);
  input = drive.input();
  input.planes = nullptr;
  const Collector without = run(GetParam(), input, drive.bundles, 20);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_TRUE(with.causal_estimates[i].state.boxminus(without.causal_estimates[i].state).isZero(0.0)) << i;
  }
}

TEST_P(MagneticBaselines, AScanWithoutReadingsOnlyAddsUncertainty) {
  const StripedField stripes;
  std::vector<ScanBundle> bundles = stripes.drive(3.0, 1);
  for (std::size_t i = 15; i < bundles.size(); ++i) bundles[i].magnetic.clear();
  const Collector result = run(GetParam(), stripes.input, bundles);
  const auto sigma_m = [&](std::size_t i) { return std::sqrt(result.causal_estimates[i].covariance(3, 3)); };
  EXPECT_GT(sigma_m(29), 1.5 * sigma_m(14));
  EXPECT_EQ(result.causal_estimates[29].diagnostics.magnetic_samples, 0);
  const Vector3 error = result.causal_estimates[29].state.T_map_imu.position -
                        StripedField::truth(result.causal_estimates[29].time).position;
  EXPECT_LT(std::abs(error.x()), 4.0 * sigma_m(29));
}

// The field repeats itself every metre: the readings fit at the initial pose, which is a metre off, as well as at the
// true pose, until the robot is past the last stripe.
TEST(MagneticParticleFilter, KeepsSeveralPlacesUntilTheFieldDecides) {
  const StripedField stripes;
  EstimatorInput input = stripes.input;
  input.initial_pose.position.x() -= 1.0;
  input.options.initial.position_sigma_m = 0.6;
  MagneticParticleFilter filter(input, ParticleOptions{});
  Collector result;
  for (const ScanBundle& bundle : stripes.drive(9.0, 5)) filter.process(bundle, result);
  const Estimate& undecided = result.causal_estimates[25];
  EXPECT_GT(std::sqrt(undecided.covariance(3, 3)), 0.3);
  const Estimate& decided = result.causal_estimates.back();
  EXPECT_LT((decided.state.T_map_imu.position - StripedField::truth(decided.time).position).head<2>().norm(), 0.1);
  EXPECT_LT(std::sqrt(decided.covariance(3, 3)), 0.1);
}

}  // namespace
}  // namespace lodestone::testing
