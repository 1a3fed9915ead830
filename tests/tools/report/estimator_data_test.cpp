// Series of a report from the files of an estimator.
#include "tools/report/estimator_data.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

/// The folder of an estimator with ten scans, one a second, 1 m apart. It has poses for the first four, with errors of
/// 0.1 to 0.4 m.
void write_estimator(const std::filesystem::path& folder) {
  std::ofstream diagnostics(folder / "diagnostics.csv");
  diagnostics << "t_s,health,health_reason,degenerate_directions,magnetic_samples,magnetic_weight,magnetic_shrink,"
                 "magnetic_residual_ut,wheel_weight";
  for (int i = 1; i <= 6; ++i) diagnostics << ",direction_" << i << "_sigma_m";
  diagnostics << "\n";
  std::ofstream poses(folder / "trajectory.tum");
  for (int i = 1; i <= 10; ++i) {
    // Scans 1 to 3 have a degenerate direction; scan 2 has magnetic samples, too, and scan 3 has wheels.
    diagnostics << fmt::format("{},{},{},{},{},1,1,1,{},1,1,1,1,1,1\n", i, i <= 4 ? "good" : "lost",
                               i <= 4 ? "none" : "covariance", i <= 3 ? 1 : 0, i == 2 ? 5 : 0, i == 3 ? "1" : "nan");
    if (i <= 4) poses << fmt::format("{} {} 0 0 0 0 0 1\n", i, i + 0.1 * i);
  }
}

Trajectory straight_truth(int first, int last) {
  Trajectory truth;
  for (int i = first; i <= last; ++i)
    truth.push_back({from_seconds(i), {Quaternion::Identity(), {static_cast<double>(i), 0.0, 0.0}}});
  return truth;
}

TEST(EstimatorData, LostScansAreBeyondEveryError) {
  const TemporaryFolder folder;
  write_estimator(folder.path());
  const EstimatorFiles files = read_estimator(folder.path());
  const TimeBuckets buckets(files.diagnostics_times, 100);
  const auto quantiles_of = [&](const Trajectory& truth) { return estimator_series(files, &truth, buckets); };
  // Four of ten scans have a pose.
  auto quantiles = quantiles_of(straight_truth(1, 10))["distribution"];
  ASSERT_EQ(quantiles.size(), 401U);
  EXPECT_NEAR(quantiles[40].get<double>(), 0.1, 1e-6);
  EXPECT_NEAR(quantiles[160].get<double>(), 0.4, 1e-6);
  for (std::size_t i = 161; i <= 400; ++i) EXPECT_TRUE(quantiles[i].is_null()) << i;
  // Scans without ground truth do not count.
  quantiles = quantiles_of(straight_truth(1, 4))["distribution"];
  EXPECT_NEAR(quantiles[100].get<double>(), 0.1, 1e-6);
  EXPECT_NEAR(quantiles[400].get<double>(), 0.4, 1e-6);
  // All scans with ground truth are lost.
  quantiles = quantiles_of(straight_truth(6, 10))["distribution"];
  ASSERT_EQ(quantiles.size(), 401U);
  EXPECT_TRUE(quantiles[0].is_null());
  EXPECT_FALSE(quantiles_of(straight_truth(20, 30)).contains("distribution"));
}

TEST(EstimatorData, CountsGoodScansThatNothingObserves) {
  const TemporaryFolder folder;
  write_estimator(folder.path());
  const auto health = health_json(read_estimator(folder.path()), 0);
  EXPECT_EQ(health["good"], 4);
  EXPECT_EQ(health["unobserved"], 1);
}

}  // namespace
}  // namespace lodestone
