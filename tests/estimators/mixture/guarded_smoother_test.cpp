#include "estimators/mixture/guarded_smoother.h"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(EstimatesDiffer, AMixtureThatIsNotFiniteReplacesNothing) {
  EXPECT_FALSE(is_replaced(at(0.0, 0.05), at(std::nan(""), 0.05)));
  EXPECT_FALSE(is_replaced(at(0.0, 0.05), at(0.0, std::nan(""))));
}

/// A window beside the truth, until it begins again.
class BesideTheTruth final : public Estimator {
 public:
  explicit BesideTheTruth(double off_m) : off_m_(off_m) {}
  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    Estimate estimate = at(0.0, 0.02);
    estimate.time = bundle.scan.end;
    estimate.state.T_map_imu = StripedField::truth(bundle.scan.end);
    estimate.state.T_map_imu.position.y() += off_m_;
    estimate.diagnostics.clock_sigma_s = 0.001;
    sink.causal(estimate);
    sink.best(estimate);
  }
  void finish(EstimateSink&) override {}
  const CalibrationEstimate* calibration() const override { return &calibration_; }

 private:
  double off_m_;
  CalibrationEstimate calibration_;
};

struct Guarded {
  Collector estimates;
  bool has_calibration = false;
  std::int64_t wrong_places = 0;
};

/// `kOff_mm`: of a window that began at the origin.
template <int kOff_mm>
Guarded guarded(double duration_s) {
  const StripedField stripes(duration_s * StripedField::kSpeed_m_s + 2.0);
  EstimatorInput input = stripes.input;
  input.options.initial.position_sigma_m = 0.1;
  WarningLog warnings;
  input.warnings = &warnings;
  GuardedSmoother estimator(input, [](EstimatorInput window) -> std::unique_ptr<Estimator> {
    const bool first = window.initial_pose.position.x() == 0.0;
    return std::make_unique<BesideTheTruth>(first ? 1e-3 * kOff_mm : 0.0);
  });
  Guarded result;
  for (const ScanBundle& bundle : stripes.drive(duration_s, 11)) estimator.process(bundle, result.estimates);
  estimator.finish(result.estimates);
  for (const auto* each : {&result.estimates.best_estimates, &result.estimates.causal_estimates}) {
    EXPECT_EQ(each->size(), static_cast<std::size_t>(std::lround(10.0 * duration_s)));
    for (std::size_t i = 0; i < each->size(); ++i) {
      EXPECT_EQ((*each)[i].time, static_cast<Time>(i + 1) * 100'000'000);
      EXPECT_EQ((*each)[i].diagnostics.clock_sigma_s, 0.001);
    }
  }
  result.has_calibration = estimator.calibration() != nullptr;
  result.wrong_places = warnings.count("smoother.wrong_place");
  return result;
}

bool is_the_window_at_the_truth(const Estimate& one) {
  return one.state.T_map_imu.position == StripedField::truth(one.time).position;
}

TEST(GuardedSmoother, ReportsAWindowAtTheRightPlace) {
  const Guarded result = guarded<0>(6.0);
  const std::vector<Estimate>& best = result.estimates.best_estimates;
  EXPECT_GE(std::count_if(best.begin(), best.end(), is_the_window_at_the_truth), 58);
  EXPECT_TRUE(result.has_calibration);
  EXPECT_EQ(result.wrong_places, 0);
}

TEST(GuardedSmoother, ReportsTheMixtureWhereTheWindowIsAtAWrongPlace) {
  const Guarded result = guarded<800>(6.0);
  EXPECT_FALSE(result.has_calibration);
  EXPECT_EQ(result.wrong_places, 1);
  for (const auto* estimates : {&result.estimates.best_estimates, &result.estimates.causal_estimates}) {
    for (const Estimate& one : *estimates) {
      const Vector3 error = one.state.T_map_imu.position - StripedField::truth(one.time).position;
      EXPECT_LT(error.head<2>().norm(), 0.3) << to_seconds(one.time);
    }
  }
}

// The lag of the mixture is 20 s.
TEST(GuardedSmoother, BeginsTheWindowAgainAfterTheLag) {
  const Guarded result = guarded<800>(30.0);
  EXPECT_FALSE(result.has_calibration);
  EXPECT_EQ(result.wrong_places, 1);
  const std::vector<Estimate>& causal = result.estimates.causal_estimates;
  EXPECT_EQ(std::count_if(causal.begin(), causal.begin() + 200, is_the_window_at_the_truth), 0);
  EXPECT_GE(std::count_if(causal.begin() + 260, causal.end(), is_the_window_at_the_truth), 35);
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
