// --refine batch against the window's result, and both against the Cramér-Rao bound.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "estimators/smoother/bound.h"
#include "tests/estimators/drive.h"
#include "tests/estimators/fault_drive.h"

namespace lodestone::testing {
namespace {

/// Also stores the estimates that the batch starts from.
struct Stages final : EstimateSink {
  std::vector<Estimate> causal_estimates;
  std::vector<Estimate> smoothed_estimates;
  std::vector<Estimate> best_estimates;
  void causal(const Estimate& estimate) override { causal_estimates.push_back(estimate); }
  void smoothed(const Estimate& estimate) override { smoothed_estimates.push_back(estimate); }
  void best(const Estimate& estimate) override { best_estimates.push_back(estimate); }
};

Stages run_stages(const EstimatorInput& input, const std::vector<ScanBundle>& bundles) {
  Stages stages;
  const auto estimator = make_estimator("smoother", input);
  for (const ScanBundle& bundle : bundles) estimator->process(bundle, stages);
  estimator->finish(stages);
  return stages;
}

EstimatorInput batch_input() {
  EstimatorInput input = shared_drive().input();
  input.options.smoother.refine = Refinement::batch;
  return input;
}

void expect_same(const std::vector<Estimate>& a, const std::vector<Estimate>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].time, b[i].time);
    ASSERT_EQ(a[i].state.T_map_imu.position, b[i].state.T_map_imu.position) << i;
    ASSERT_EQ(a[i].state.T_map_imu.rotation.coeffs(), b[i].state.T_map_imu.rotation.coeffs()) << i;
    ASSERT_EQ(a[i].covariance, b[i].covariance) << i;
  }
}

TEST(BatchRefinement, EndsWithEveryKeyframeAndLosesNothing) {
  const Drive& drive = shared_drive();
  const Stages stages = run_stages(batch_input(), drive.bundles);
  ASSERT_EQ(stages.best_estimates.size(), drive.bundles.size());
  // The window's estimates are bit-identical to those of a run without a batch.
  expect_same(stages.smoothed_estimates, run("smoother", drive.input(), drive.bundles).best_estimates);
  const Accuracy smoothed = accuracy(stages.smoothed_estimates, drive.truth);
  const Accuracy batch = accuracy(stages.best_estimates, drive.truth);
  EXPECT_LT(batch.ate_m, 1.1 * smoothed.ate_m);
  EXPECT_LT(batch.nees, 2.0);
  // Covariances do not increase, except by the change of weights.
  double window_trace = 0.0;
  double batch_trace = 0.0;
  for (std::size_t i = 0; i < stages.best_estimates.size(); ++i) {
    window_trace += stages.smoothed_estimates[i].covariance.bottomRightCorner<3, 3>().trace();
    batch_trace += stages.best_estimates[i].covariance.bottomRightCorner<3, 3>().trace();
  }
  EXPECT_LT(batch_trace, 1.02 * window_trace);
}

// In the first metres, the window cannot know that the map is exact.
TEST(BatchRefinement, IsAsAccurateInTheFirstMetresAsLater) {
  const Drive drive = warehouse().drive(16.0, "");
  EstimatorInput input = drive.input();
  input.field = nullptr;
  input.options.smoother.refine = Refinement::batch;
  const Stages stages = run_stages(input, drive.bundles);
  const auto begin = stages.best_estimates.begin();
  const auto later = begin + static_cast<std::ptrdiff_t>(stages.best_estimates.size() / 4);
  const double at_first_m = accuracy({begin, later}, drive.truth).ate_m;
  const double later_m = accuracy({later, stages.best_estimates.end()}, drive.truth).ate_m;
  std::printf("ATE %.5f m at first, %.5f m later\n", at_first_m, later_m);
  EXPECT_LT(at_first_m, 1.5 * later_m);
}

TEST(BatchRefinement, JudgesReadingsAtTheClockThatItEstimates) {
  const auto field_weight = [](const std::string& fault) {
    const Drive drive = warehouse().drive(12.0, fault);
    EstimatorInput input = drive.input();
    input.suite.calibration.magnetometers.clock_sigma_s = 0.1;
    input.options.smoother.refine = Refinement::batch;
    const Stages stages = run_stages(input, drive.bundles);
    double sum = 0.0;
    for (const Estimate& estimate : stages.best_estimates) sum += estimate.diagnostics.magnetic_weight;
    const Accuracy batch = accuracy(stages.best_estimates, drive.truth);
    std::printf("ATE %.4f m, NEES %.2f, weight %.4f\n", batch.ate_m, batch.nees,
                sum / static_cast<double>(stages.best_estimates.size()));
    return sum / static_cast<double>(stages.best_estimates.size());
  };
  const double exact = field_weight("");
  EXPECT_GT(field_weight("{kind: clock_offset, sensor: magnetometers, offset_s: -0.2}"), 0.95 * exact);
}

TEST(BatchRefinement, GivesTheSameBitsOnAnyNumberOfThreads) {
  const std::vector<ScanBundle> bundles(shared_drive().bundles.begin(), shared_drive().bundles.begin() + 60);
  std::vector<Stages> results;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(run_stages(batch_input(), bundles));
  }
  expect_same(results[0].best_estimates, results[1].best_estimates);
}

TEST(BatchRefinement, KeepsWhatTheWindowGaveWhenItIsStopped) {
  const std::vector<ScanBundle> bundles(shared_drive().bundles.begin(), shared_drive().bundles.begin() + 60);
  EstimatorInput input = batch_input();
  int calls = 0;
  input.refining = [&calls](double share) {
    EXPECT_GE(share, 0.0);
    EXPECT_LE(share, 1.0);
    return ++calls < 1;
  };
  const Stages stages = run_stages(input, bundles);
  EXPECT_EQ(calls, 1);
  expect_same(stages.best_estimates, stages.smoothed_estimates);
}

// Without magnetometers nothing but the IMU knows the way along the bore, and the batch takes its bend for knowledge.
TEST(BatchRefinement, KeepsWhatTheWindowGaveWhereItContradictsIt) {
  const Drive& drive = shared_drive();
  EstimatorInput input = batch_input();
  input.field = nullptr;
  WarningLog warnings;
  input.warnings = &warnings;
  const Stages stages = run_stages(input, drive.bundles);
  expect_same(stages.best_estimates, stages.smoothed_estimates);
  EXPECT_EQ(warnings.count("batch.refused"), 1);
}

TEST(BatchRefinement, RefinesARunWithoutLidarAndOneWithoutMagnetometers) {
  const std::vector<ScanBundle> bundles(shared_drive().bundles.begin(), shared_drive().bundles.begin() + 100);
  EstimatorInput input = batch_input();
  input.planes = nullptr;
  EXPECT_LT(accuracy(run_stages(input, bundles).best_estimates, shared_drive().truth).max_m, 0.1);
  input = batch_input();
  input.field = nullptr;
  EXPECT_EQ(run_stages(input, bundles).best_estimates.size(), bundles.size());
}

TEST(Bound, FallsWithEveryStageAndIsMetByTheSmoother) {
  const Drive& drive = shared_drive();
  const Stages bound = run_stages(bound_input(drive.input(), drive.truth), drive.bundles);
  const auto rmse = [](const std::vector<Estimate>& estimates) {
    double sum = 0.0;
    for (const Estimate& estimate : estimates) sum += estimate.covariance.bottomRightCorner<3, 3>().trace();
    return std::sqrt(sum / static_cast<double>(estimates.size()));
  };
  EXPECT_LT(rmse(bound.smoothed_estimates), rmse(bound.causal_estimates));
  EXPECT_LT(rmse(bound.best_estimates), 1.001 * rmse(bound.smoothed_estimates));
  for (std::size_t i = 0; i < drive.bundles.size(); ++i) {
    // Nothing is solved: the states are the ground truth's.
    const auto pose = interpolate(drive.truth, bound.best_estimates[i].time, 200'000'000);
    if (!pose) continue;
    EXPECT_LT((bound.best_estimates[i].state.T_map_imu.position - pose->position).norm(), 1e-9);
  }
  const double ratio = accuracy(run("smoother", drive.input(), drive.bundles).best_estimates, drive.truth).ate_m /
                       rmse(bound.smoothed_estimates);
  EXPECT_LT(ratio, 1.3);
  EXPECT_GT(ratio, 0.4);
}

}  // namespace
}  // namespace lodestone::testing
