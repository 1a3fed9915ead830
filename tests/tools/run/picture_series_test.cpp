// The data of pictures where an estimator is lost, and where the ground truth is longer or shorter than the log.
#include "tools/run/picture_series.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

constexpr Time kScan = from_seconds(0.1);

Pose at_x(double x) {
  return {Quaternion::Identity(), {x, 0.0, 0.0}};
}

/// Ground truth of scans `first` to `last`, at 1 m a scan.
Trajectory truth_of(int first, int last) {
  Trajectory truth;
  for (int i = first; i <= last; ++i) truth.push_back({i * kScan, at_x(i)});
  return truth;
}

/// Scans 1 to `last`, lost from `lost_from` on. The error of scan i is i mm.
EstimatorOutcome outcome_of(const std::string& name, int last, int lost_from, const Trajectory& truth) {
  EstimatorOutcome outcome;
  outcome.summary.estimator = name;
  for (int i = 1; i <= last; ++i) {
    Estimate estimate;
    estimate.time = i * kScan;
    estimate.health = i >= lost_from ? Health::lost : Health::good;
    estimate.state.T_map_imu = at_x(i + 0.001 * i);
    estimate.covariance = 1e-6 * Matrix6::Identity();
    outcome.record.causal(estimate);
    outcome.record.best(estimate);
  }
  outcome.summary.truth = compare_with_truth(outcome.record, truth, last * kScan, RunStatus::done);
  return outcome;
}

TEST(PictureSeries, HasEveryScanWithGroundTruthAndNoErrorWhereItIsLost) {
  const Trajectory truth = truth_of(0, 100);
  const PictureSeries series = picture_series(outcome_of("ieskf", 6, 4, truth), truth);
  ASSERT_EQ(series.error_m.size(), 6U);
  EXPECT_NEAR(series.error_m[2], 0.003, 1e-9);
  for (std::size_t i = 3; i < 6; ++i) EXPECT_TRUE(std::isnan(series.error_m[i])) << i;
  EXPECT_NEAR(series.error_time_s[5], 0.6, 1e-9);
}

TEST(PictureSeries, AScanWithoutGroundTruthIsNotALostOne) {
  const Trajectory truth = truth_of(0, 3);
  const PictureSeries series = picture_series(outcome_of("ieskf", 6, 100, truth), truth);
  ASSERT_EQ(series.error_m.size(), 3U);
  EXPECT_NEAR(series.error_m[2], 0.003, 1e-9);
}

TEST(PictureSeries, TheGroundTruthIsDrawnToTheEndOfTheLogWhoeverIsLost) {
  const Trajectory truth = truth_of(0, 60);
  const std::vector<EstimatorOutcome> outcomes{outcome_of("lidar-inertial", 20, 10, truth),
                                               outcome_of("smoother", 40, 100, truth)};
  const std::vector<Time> scans = scan_ends(outcomes);
  ASSERT_EQ(scans.size(), 40U);
  EXPECT_EQ(scans.back(), 40 * kScan);
  const std::vector<PictureSeries> series{picture_series(outcomes[0], truth), picture_series(outcomes[1], truth)};
  const TemporaryFolder folder;
  write_pictures(folder / "written", nullptr, truth, scans, series);
  draw_map_picture(folder / "expected", nullptr, truth_of(1, 40), series);
  EXPECT_EQ(content_of(folder / "written/map.svg"), content_of(folder / "expected.svg"));
}

}  // namespace
}  // namespace lodestone
