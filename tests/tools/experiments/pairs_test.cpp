// Pairs and their statistics, with hand-written results in the folders of runs.
#include "tools/experiments/pairs.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "tests/tools/experiments/ablation_files.h"
#include "tools/experiments/ablate_call.h"
#include "tools/experiments/ablation_tables.h"

namespace lodestone::ablation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class AblationPairs : public testing::Test {
 protected:
  /// Writes a finished run of `variant` (index) with this ATE.
  void put(std::size_t variant, const std::string& drive, int seed, double ate, bool success = true) {
    const std::string group = recipe_name(ablation_, ablation_.variants[variant]);
    for (std::size_t i = 0; i < plan_.runs.size(); ++i) {
      const reproduce::Run& run = plan_.runs[i];
      if (run.group != group || drive_name(run) != drive || run.seed != seed) continue;
      done_[i] = true;
      const std::filesystem::path folder = folder_ / run.folder / "smoother";
      std::filesystem::create_directories(folder);
      std::ofstream(folder / "summary.json")
          << "{\"estimator\": \"smoother\", \"ate_m\": " << ate << ", \"max_error_m\": " << 2.0 * ate
          << ", \"heading_rmse_deg\": null, \"nees_pose\": 1.5, \"nees_causal\": 2.5, \"wall_s\": 3, \"success\": "
          << (success ? "true" : "false") << ", \"stale_map\": {\"places\": 7}, \"warnings\": {\"w\": {\"count\": 9}}}";
      return;
    }
    ADD_FAILURE() << "no such run: " << variant << " " << drive << " " << seed;
  }
  reproduce::Results results() const { return reproduce::Results(plan_, folder_.path(), done_); }
  Comparison comparison(std::size_t variant) const {
    const reproduce::Results known = results();
    return compare_pairs(pairs_of(ablation_, ablation_.variants[variant], known), "ate_m");
  }
  std::vector<std::string> status() const {
    std::vector<std::string> all;
    for (const bool done : done_) all.emplace_back(done ? "done" : "missing");
    return all;
  }

  TemporaryFolder folder_;
  Ablation ablation_ = load_ablation(write_yard(folder_), false);
  reproduce::Plan plan_ = make_plan(meant_runs(ablation_), "");
  std::vector<bool> done_ = std::vector<bool>(plan_.runs.size(), false);
  const std::string near_ = "yard-out-5m";
  const std::string far_ = "yard-out-30m";
};

TEST_F(AblationPairs, ArePairedByDriveRangeAndSeed) {
  put(0, far_, 1, 0.010);
  put(0, far_, 2, 0.020);
  put(0, near_, 1, 0.100);
  put(0, near_, 2, 0.400);
  put(1, far_, 1, 0.011);
  put(1, far_, 2, 0.016);
  put(1, near_, 1, 0.120);
  put(1, near_, 2, 0.400);
  const Comparison found = comparison(1);
  EXPECT_EQ(found.pairs, 4U);
  EXPECT_EQ(found.done, 4U);
  EXPECT_THAT(found.ratios,
              testing::UnorderedElementsAre(testing::DoubleNear(1.1, 1e-12), testing::DoubleNear(0.8, 1e-12),
                                            testing::DoubleNear(1.2, 1e-12), 1.0));
  EXPECT_EQ(found.better, 1U);
  EXPECT_EQ(found.worse, 2U);
  EXPECT_EQ(found.equal, 1U);
  // By hand: mean and standard deviation of the logarithms, t of three degrees of freedom.
  const double logs[] = {std::log(1.1), std::log(0.8), std::log(1.2), 0.0};
  double mean = 0.0;
  double squares = 0.0;
  for (const double one : logs) mean += one / 4.0;
  for (const double one : logs) squares += (one - mean) * (one - mean);
  const double half = 3.182446 * std::sqrt(squares / 3.0) / 2.0;
  EXPECT_NEAR(found.over_pairs->ratio, std::exp(mean), 1e-12);
  EXPECT_NEAR(*found.over_pairs->low, std::exp(mean - half), 1e-6);
  EXPECT_NEAR(*found.over_pairs->high, std::exp(mean + half), 1e-6);
  // Two drives: one degree of freedom.
  const double a = 0.5 * (logs[0] + logs[1]);
  const double b = 0.5 * (logs[2] + logs[3]);
  EXPECT_EQ(found.over_drives->pairs, 2U);
  EXPECT_NEAR(found.over_drives->ratio, std::exp(0.5 * (a + b)), 1e-12);
  EXPECT_NEAR(*found.over_drives->high, std::exp(0.5 * (a + b) + 12.7062 * 0.5 * std::abs(a - b)), 1e-4);
}

TEST_F(AblationPairs, ALostRunGivesNoRatioButCounts) {
  put(0, far_, 1, 0.01);
  put(1, far_, 1, 50.0, false);
  put(0, far_, 2, 50.0, false);
  put(1, far_, 2, 0.01);
  put(0, near_, 1, 50.0, false);
  put(1, near_, 1, 40.0, false);
  put(0, near_, 2, 0.01);
  put(1, near_, 2, 0.02);
  const Comparison found = comparison(1);
  EXPECT_EQ(found.lost, 2U);
  EXPECT_EQ(found.baseline_lost, 2U);
  EXPECT_EQ(found.worse, 2U);
  EXPECT_EQ(found.better, 1U);
  EXPECT_EQ(found.equal, 0U);
  EXPECT_THAT(found.ratios, ElementsAre(2.0));
  EXPECT_FALSE(found.over_pairs->low.has_value());
}

TEST_F(AblationPairs, WhatHasNotRunIsLeftOut) {
  put(0, far_, 1, 0.01);
  put(1, far_, 2, 0.01);
  const Comparison found = comparison(1);
  EXPECT_EQ(found.pairs, 4U);
  EXPECT_EQ(found.done, 0U);
  EXPECT_FALSE(found.over_pairs.has_value());
}

TEST_F(AblationPairs, TablesSayItAll) {
  put(0, far_, 1, 0.010);
  put(0, far_, 2, 0.010);
  put(1, far_, 1, 0.010);
  put(1, far_, 2, 0.020);
  put(0, near_, 1, 0.010);
  put(1, near_, 1, 2.0, false);
  const reproduce::ResultTable summary = summary_table(ablation_, results());
  ASSERT_EQ(summary.rows.size(), 3U);
  EXPECT_THAT(summary.header, ElementsAre("variant", "pairs", "lost", "ATE m", "ATE ratio", "95 %", "95 % over drives",
                                          "better", "worse", "equal", "largest error ratio", "largest jump ratio",
                                          "heading ratio", "nees_causal", "NEES", "time ratio"));
  EXPECT_THAT(summary.rows[0], ElementsAre("as shipped", "3 of 4", "0", "0.0100", "baseline", "", "", "", "", "", "",
                                           "", "", "2.50", "1.50", ""));
  EXPECT_THAT(summary.rows[1], ElementsAre("no mask", "3 of 4", "1", "0.0141", "1.414", "0.017 – 115.608", "-", "0",
                                           "2", "1", "1.414", "-", "-", "2.50", "1.50", "1.000"));
  EXPECT_THAT(summary.rows[2], ElementsAre("one magnetometer", "0 of 4", "0", "-", "…", "…", "…", "…", "…", "…", "…",
                                           "…", "…", "-", "-", "…"));
  EXPECT_THAT(summary.note, HasSubstr("Baseline: as shipped."));
  const reproduce::ResultTable drives = drives_table(ablation_, results());
  EXPECT_THAT(drives.header, ElementsAre("variant", far_, near_));
  EXPECT_THAT(drives.rows[0], ElementsAre("as shipped", "0.0100 m", "0.0100 m"));
  EXPECT_THAT(drives.rows[1], ElementsAre("no mask", "1.414", "/"));
  EXPECT_THAT(drives.rows[2], ElementsAre("one magnetometer", "…", "…"));
}

TEST_F(AblationPairs, TheTidyTableHasARowARunWithEverySwitchAndFigure) {
  put(1, far_, 2, 0.020);
  const reproduce::ResultTable tidy = tidy_table(ablation_, results(), status());
  EXPECT_EQ(tidy.rows.size(), plan_.runs.size());
  EXPECT_THAT(tidy.header,
              ElementsAre("ablation", "variant", "baseline", "estimator", "degeneracy.rule", "magnetic.magnetometers",
                          "world", "sequence", "scene", "range_m", "noise_ut", "seed", "status", "ate_m", "max_error_m",
                          "nees_pose", "success", "wall_s", "nees_causal", "stale_map.places", "folder"));
  int done = 0;
  for (const auto& row : tidy.rows) {
    ASSERT_EQ(row.size(), tidy.header.size());
    if (row[12] != "done") {
      EXPECT_EQ(row[13], "");
      continue;
    }
    ++done;
    EXPECT_THAT(row, ElementsAre("yard", "no mask", "0", "smoother", "none", "all", "yard", "out", "", "30", "1", "2",
                                 "done", "0.02", "0.04", "1.5", "1", "3", "2.5", "7",
                                 "runs/smoother+degeneracy.rule=none/yard-out-30m/seed2"));
  }
  EXPECT_EQ(done, 1);
}

}  // namespace
}  // namespace lodestone::ablation
