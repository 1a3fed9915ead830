#include "estimators/mixture/guarded_smoother.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/estimators/baselines/striped_field.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

Estimate at(double x_m, double sigma_m) {
  Estimate result;
  result.state.T_map_imu.position.x() = x_m;
  result.covariance = Matrix6::Identity() * sigma_m * sigma_m;
  return result;
}

TEST(EstimatesDiffer, ByTheSigmasOfBoth) {
  EXPECT_FALSE(differ(at(0.2, 0.03), at(0.0, 0.05)));
  EXPECT_TRUE(differ(at(0.4, 0.03), at(0.0, 0.05)));
  EXPECT_FALSE(differ(at(0.4, 0.1), at(0.0, 0.05)));
  EXPECT_TRUE(differ(at(std::nan(""), 0.03), at(0.0, 0.05)));
}

TEST(EstimatesDiffer, IfOneIsUnsureWhereTheOtherIsFarSurer) {
  EXPECT_TRUE(differ(at(0.0, 0.05), at(0.0, 0.5)));
  EXPECT_TRUE(differ(at(0.0, 0.5), at(0.0, 0.05)));
  EXPECT_FALSE(differ(at(0.0, 0.2), at(0.0, 0.5)));
  EXPECT_FALSE(differ(at(0.0, 0.2), at(0.0, 0.02)));
}

// The same readings: of the two covariances, that of the mixture counts.
TEST(EstimatesDiffer, AWindowBeyondTheCovarianceOfTheMixtureIsReplaced) {
  EXPECT_FALSE(is_replaced(at(0.2, 0.2), at(0.0, 0.05)));
  EXPECT_TRUE(is_replaced(at(0.4, 0.2), at(0.0, 0.05)));
  EXPECT_FALSE(is_replaced(at(0.4, 0.05), at(0.0, 0.2)));
  EXPECT_TRUE(is_replaced(at(0.0, 0.05), at(0.0, 0.5)));
}

/// A window that follows the truth from a place beside it.
class BesideTheTruth final : public Estimator {
 public:
  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    Estimate estimate = at(0.0, 0.02);
    estimate.time = bundle.scan.end;
    estimate.state.T_map_imu = StripedField::truth(bundle.scan.end);
    estimate.state.T_map_imu.position.y() += off_m;
    sink.causal(estimate);
    sink.best(estimate);
  }
  void finish(EstimateSink&) override {}
  static double off_m;
};
double BesideTheTruth::off_m = 0.0;

Collector guarded(double off_m) {
  BesideTheTruth::off_m = off_m;
  const StripedField stripes;
  EstimatorInput input = stripes.input;
  input.options.initial.position_sigma_m = 0.1;
  GuardedSmoother estimator(
      input, [](EstimatorInput) -> std::unique_ptr<Estimator> { return std::make_unique<BesideTheTruth>(); });
  Collector result;
  for (const ScanBundle& bundle : stripes.drive(6.0, 11)) estimator.process(bundle, result);
  estimator.finish(result);
  EXPECT_EQ(result.best_estimates.size(), 60U);
  EXPECT_EQ(result.causal_estimates.size(), 60U);
  return result;
}

TEST(GuardedSmoother, ReportsAWindowAtTheRightPlace) {
  int of_the_window = 0;
  for (const Estimate& best : guarded(0.0).best_estimates) {
    of_the_window += best.state.T_map_imu.position == StripedField::truth(best.time).position ? 1 : 0;
  }
  EXPECT_GE(of_the_window, 58);
}

TEST(GuardedSmoother, ReportsTheMixtureWhereTheWindowIsAtAWrongPlace) {
  const Collector result = guarded(0.8);
  for (const auto* estimates : {&result.best_estimates, &result.causal_estimates}) {
    for (const Estimate& one : *estimates) {
      const Vector3 error = one.state.T_map_imu.position - StripedField::truth(one.time).position;
      EXPECT_LT(error.head<2>().norm(), 0.3) << to_seconds(one.time);
    }
  }
}

// The field repeats itself every metre, and the initial pose is a metre off: the window alone begins at a wrong place.
TEST(GuardedSmoother, IsAtTheRightPlaceThoughTheWindowBeganAtAWrongOne) {
  const StripedField stripes;
  EstimatorInput input = stripes.input;
  input.initial_pose.position.x() -= 1.0;
  input.options.initial.position_sigma_m = 0.6;
  const Collector result = run("magnetic", input, stripes.drive(9.0, 5));
  for (const Estimate& best : result.best_estimates) {
    const Vector3 error = best.state.T_map_imu.position - StripedField::truth(best.time).position;
    EXPECT_LT(error.head<2>().norm(), 0.2) << to_seconds(best.time);
  }
}

}  // namespace
}  // namespace lodestone::testing
