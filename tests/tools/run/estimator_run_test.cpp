// One estimator's pass over a log, with a substitute estimator that has the ground truth and given errors.
#include "tools/run/estimator_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"
#include "tests/tools/program_runner.h"
#include "tests/tools/run/stand_in.h"
#include "tools/progress.h"
#include "tools/run/bound_run.h"
#include "tools/writers/covariance_file.h"
#include "tools/writers/csv_table.h"
#include "tools/writers/estimate_files.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

TEST_F(EstimatorRunTest, WritesEveryFileWhole) {
  StandIn stand_in;
  stand_in.offset = {0.0, 0.3, 0.0};
  WarningLog warnings;
  warnings.add("lidar.nan_points", "12 points are no numbers", from_seconds(0.1), 12);
  const EstimatorOutcome outcome = run_estimator(run_with(stand_in), warnings);
  EXPECT_EQ(outcome.summary.status, RunStatus::done);

  const Trajectory best = read_trajectory((folder_ / "stand-in/trajectory.tum").string());
  const Trajectory causal = read_trajectory((folder_ / "stand-in/causal.tum").string());
  ASSERT_EQ(best.size(), static_cast<std::size_t>(kScans));
  ASSERT_EQ(causal.size(), best.size());
  EXPECT_EQ(best.back().time, from_seconds(0.1 * kScans));
  EXPECT_LT(best[50].pose.boxminus(outcome.record.best()[50].pose).norm(), 1e-7);
  const auto covariances = read_covariances(folder_ / "stand-in/covariance.csv");
  ASSERT_EQ(covariances.size(), best.size());
  EXPECT_EQ(covariances[7].time, best[7].time);
  EXPECT_TRUE(covariances[7].covariance.isApprox(0.01 * Matrix6::Identity()));
  const std::string diagnostics = content_of(folder_ / "stand-in/diagnostics.csv");
  EXPECT_EQ(std::count(diagnostics.begin(), diagnostics.end(), '\n'), kScans + 1);
  const std::string header = diagnostics.substr(0, diagnostics.find('\n'));
  const std::string row =
      diagnostics.substr(header.size() + 1, diagnostics.find('\n', header.size() + 1) - header.size() - 1);
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(row.begin(), row.end(), ','));
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "stand-in")) {
    EXPECT_EQ(entry.path().string().find("partial"), std::string::npos);
  }
}

/// An estimator that must not be called.
class Unused final : public Estimator {
  void process(const ScanBundle&, EstimateSink&) override { ADD_FAILURE(); }
  void finish(EstimateSink&) override { ADD_FAILURE(); }
};

TEST_F(EstimatorRunTest, AResumedRunReplaysWhatHadEnded) {
  StandIn stand_in;
  stand_in.offset = {0.0, 0.3, 0.0};
  stand_in.last_health = Health::lost;
  EstimatorRun run = run_with(stand_in);
  run.recording = folder_ / "stand-in.estimates";
  run.resume = true;  // there is no recording yet
  WarningLog warnings;
  warnings.add("of.the.maps", "made up", 3, 2);
  run_estimator(run, warnings);
  std::map<std::string, std::string> wanted;
  for (const auto& entry : std::filesystem::directory_iterator(run.folder))
    wanted[entry.path().filename()] = content_of(entry.path());
  ASSERT_EQ(wanted.size(), 6U);
  std::filesystem::remove_all(run.folder);

  run.make_estimator = [](const ScanBundle&) { return std::make_unique<Unused>(); };
  WarningLog again;
  EXPECT_EQ(run_estimator(run, again).summary.status, RunStatus::lost);
  for (const auto& [name, content] : wanted) EXPECT_TRUE(content_of(run.folder / name) == content) << name;

  // A damaged recording counts as none.
  std::string recorded = content_of(run.recording);
  recorded[recorded.size() / 2] ^= 1;
  std::ofstream(run.recording, std::ios::binary) << recorded;
  run.make_estimator = run_with(stand_in).make_estimator;
  WarningLog anew;
  run_estimator(run, anew);
  EXPECT_EQ(content_of(run.folder / "trajectory.tum"), wanted.at("trajectory.tum"));
}

TEST_F(EstimatorRunTest, SummaryHasTheContractsKeys) {
  StandIn stand_in;
  stand_in.offset = {0.0, 0.3, 0.0};
  WarningLog warnings;
  run_estimator(run_with(stand_in), warnings);
  const nlohmann::json json = summary();
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_THAT(keys,
              testing::UnorderedElementsAre("estimator", "scans", "duration_s", "wall_s", "refine_s", "work_s",
                                            "real_time_factor", "peak_rss_mb", "status", "lost", "uncertain_scans",
                                            "degenerate_scans", "magnetic_rejected", "warnings", "ate_m", "ate_se3_m",
                                            "max_error_m", "heading_rmse_deg", "nees_pose", "success", "stages"));
  EXPECT_EQ(json["scans"], kScans);
  EXPECT_NEAR(json["duration_s"].get<double>(), 10.0, 1e-9);
  EXPECT_EQ(json["status"], "done");
  EXPECT_TRUE(json["lost"].is_array() && json["lost"].empty());
  EXPECT_EQ(json["degenerate_scans"], kScans / 4);
  EXPECT_EQ(json["magnetic_rejected"], 2 * kScans);
  EXPECT_NEAR(json["ate_m"].get<double>(), 0.3, 1e-9);
  EXPECT_NEAR(json["ate_se3_m"].get<double>(), 0.0, 1e-9);
  EXPECT_NEAR(json["max_error_m"].get<double>(), 0.3, 1e-9);
  EXPECT_NEAR(json["heading_rmse_deg"].get<double>(), 0.0, 1e-9);
  EXPECT_NEAR(json["nees_pose"].get<double>(), 0.09 / 0.01 / 6.0, 1e-9);
  EXPECT_GT(json["peak_rss_mb"].get<double>(), 1.0);
  EXPECT_TRUE(json["success"].get<bool>());
}

TEST_F(EstimatorRunTest, AJumpIsToldFromASteadyError) {
  StandIn stand_in;
  stand_in.offset = {0.0, 0.3, 0.0};
  stand_in.jump = {0.0, 0.0, 0.2};
  WarningLog warnings;
  run_estimator(run_with(stand_in), warnings);
  EXPECT_NEAR(summary()["stages"]["causal"]["largest_jump_m"].get<double>(), 0.2, 1e-9);
}

TEST_F(EstimatorRunTest, CoverageIsTheShareOfTheTimeWithinAnError) {
  StandIn stand_in;
  stand_in.offset = {0.0, 0.09, 0.0};
  stand_in.jump = {0.0, 0.4, 0.0};  // with the scan 50 of 100, 4.9 s after the first
  EstimatorRun run = run_with(stand_in);
  WarningLog warnings;
  run_estimator(run, warnings);
  EXPECT_NEAR(summary()["stages"]["causal"]["share_within_100mm"].get<double>(), 4.9 / 9.9, 1e-9);
  EXPECT_NEAR(summary()["stages"]["causal"]["share_within_1m"].get<double>(), 1.0, 1e-9);
}

TEST_F(EstimatorRunTest, CoverageCountsTheTimeWithoutEstimates) {
  EstimatorRun run = run_with(StandIn{});
  for (Time time = truth_.back().time; time <= from_seconds(15.0); time += from_seconds(0.005))
    truth_.push_back({time + from_seconds(0.005), true_pose(time)});
  run.open = [open = run.open]() {
    OpenedLog log = open();
    log.end += from_seconds(5.0);  // without scans
    return log;
  };
  WarningLog warnings;
  run_estimator(run, warnings);
  EXPECT_NEAR(summary()["stages"]["causal"]["share_within_1m"].get<double>(), 9.9 / 14.9, 1e-9);
}

TEST_F(EstimatorRunTest, SuccessEndsAtOneMetre) {
  StandIn stand_in;
  stand_in.offset = {0.0, 0.0, 1.01};
  WarningLog warnings;
  EXPECT_FALSE(run_estimator(run_with(stand_in), warnings).summary.truth->success);
}

TEST_F(EstimatorRunTest, SuccessNeedsTheEndOfTheLog) {
  EstimatorRun run = run_with(StandIn{});
  run.open = [open = run.open]() {
    OpenedLog log = open();
    log.end += from_seconds(5.0);
    return log;
  };
  WarningLog warnings;
  EXPECT_FALSE(run_estimator(run, warnings).summary.truth->success);
}

TEST_F(EstimatorRunTest, TruthOfAPartOfTheLogIsNoSuccessAndIsReported) {
  const auto cut_truth = [this](double end_s) {
    std::erase_if(truth_, [end_s](const StampedPose& pose) { return pose.time > from_seconds(end_s); });
  };
  EstimatorRun run = run_with(StandIn{});
  run.truth_file = "half.tum";
  cut_truth(9.25);  // within a second of the log's end
  WarningLog nearly_whole;
  EXPECT_TRUE(run_estimator(run, nearly_whole).summary.truth->success);
  EXPECT_EQ(nearly_whole.count("run.truth"), 0);

  cut_truth(3.05);
  WarningLog warnings;
  EXPECT_FALSE(run_estimator(run, warnings).summary.truth->success);
  EXPECT_NEAR(summary()["stages"]["causal"]["share_within_1m"].get<double>(), 2.9 / 9.9, 1e-9);
  EXPECT_EQ(warnings.count("run.truth"), 1);
  EXPECT_EQ(summary()["warnings"]["run.truth"]["first"],
            "half.tum spans 0.000000000 s to 3.050000000 s, the log 0.000000000 s to 10.000000000 s: 30 of 100 poses "
            "are compared");

  cut_truth(0.15);  // one pose
  WarningLog at_one_pose;
  run_estimator(run, at_one_pose);
  EXPECT_EQ(summary()["stages"]["causal"]["share_within_1m"].get<double>(), 0.0);
  EXPECT_EQ(at_one_pose.count("run.truth"), 1);
}

TEST_F(EstimatorRunTest, WithoutTruthThereAreNoFiguresAgainstIt) {
  EstimatorRun run = run_with(StandIn{});
  run.truth = nullptr;
  WarningLog warnings;
  run_estimator(run, warnings);
  EXPECT_FALSE(summary().contains("ate_m"));
  EXPECT_FALSE(summary().contains("success"));
}

TEST_F(EstimatorRunTest, NumbersThatAreNoneAreNoSuccess) {
  StandIn stand_in;
  stand_in.offset = {0.0, std::nan(""), 0.0};
  WarningLog warnings;
  EXPECT_FALSE(run_estimator(run_with(stand_in), warnings).summary.truth->success);
  EXPECT_TRUE(summary()["ate_m"].is_null());
}

TEST_F(EstimatorRunTest, KeepsWhatItHasWhenTheLogBreaksOff) {
  EstimatorRun run = run_with(StandIn{});
  run.open = opened_with(run, [](int count) {
    if (count > 30) throw InputError("log.bag: chunk 7 is cut off");
  });
  WarningLog warnings;
  EXPECT_THROW(run_estimator(run, warnings), InputError);
  EXPECT_EQ(read_trajectory((folder_ / "stand-in/trajectory.tum").string()).size(), 30U);
  EXPECT_THAT(content_of(folder_ / "stand-in/trajectory.tum"), HasSubstr("chunk 7 is cut off"));
  EXPECT_TRUE(summary()["warnings"].contains("run.stopped"));
}

TEST_F(EstimatorRunTest, RefusesALogWithoutScans) {
  EstimatorRun run = run_with(StandIn{});
  run.open = []() { return OpenedLog{0, 0, [](ScanBundle&) { return false; }}; };
  WarningLog warnings;
  EXPECT_THROW(run_estimator(run, warnings), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "stand-in/trajectory.tum"));
}

using EstimatorRunDeathTest = EstimatorRunTest;

TEST_F(EstimatorRunDeathTest, KeepsWhatItHasWhenInterrupted) {
  const auto run_and_exit = [this]() {
    catch_interrupts();
    EstimatorRun run = run_with(StandIn{});
    run.open = opened_with(run, [](int count) {
      if (count == 20) std::raise(SIGINT);
    });
    WarningLog warnings;
    std::exit(run_estimator(run, warnings).summary.status == RunStatus::interrupted ? 0 : 1);
  };
  EXPECT_EXIT(run_and_exit(), testing::ExitedWithCode(0), "");
  EXPECT_EQ(read_trajectory((folder_ / "stand-in/trajectory.tum").string()).size(), 20U);
  EXPECT_THAT(content_of(folder_ / "stand-in/causal.tum"), HasSubstr("# interrupted at 2.000000000 s of 10.000000000"));
  EXPECT_TRUE(summary()["warnings"].contains("run.interrupted"));
}

TEST(RunReport, TableAndWarningsNameEveryRun) {
  RunSummary smoother;
  smoother.estimator = "smoother";
  smoother.scans = 600;
  smoother.duration_s = 60.0;
  smoother.wall_s = 10.0;
  smoother.truth = TruthFigures{{}, 0.0123, 0.0101, 0.04, 0.2, 1.1, true};
  smoother.warnings.add("imu.gap", "no sample for 0.2 s", 0);
  RunSummary ieskf = smoother;
  ieskf.estimator = "ieskf";
  ieskf.warnings.add("smoother.only", "made up", 0, 3);
  const std::string table = ab_table({smoother, ieskf});
  EXPECT_THAT(table, HasSubstr("ATE m"));
  EXPECT_THAT(table, HasSubstr("0.0123"));
  EXPECT_THAT(table, HasSubstr("6.0"));
  const std::string warnings = warnings_text({smoother, ieskf});
  EXPECT_THAT(warnings, HasSubstr("imu.gap (1 x): no sample for 0.2 s"));
  EXPECT_THAT(warnings, HasSubstr("smoother.only (3 x in ieskf): made up"));
  CallRecord call;
  call.call.settings = {"smoother.window_s=2"};
  call.call.configurations = {"night.yaml"};
  call.max_range_m = 12.5;
  call.refines = true;
  const auto json =
      nlohmann::json::parse(to_json({{"log", "a.bag"}, {"magnetic", ""}}, call, {smoother, ieskf}, std::nullopt));
  EXPECT_EQ(json["call"]["max_range_m"], 12.5);
  EXPECT_EQ(json["call"]["refine"], "batch");
  EXPECT_EQ(json["call"]["set"], nlohmann::json({"smoother.window_s=2"}));
  EXPECT_EQ(json["call"]["config"], nlohmann::json({"night.yaml"}));
  EXPECT_FALSE(json["call"].contains("threads"));  // options that do not affect results must not affect the file
  EXPECT_FALSE(json["call"].contains("resume"));
  EXPECT_EQ(json["status"], "done");
  EXPECT_TRUE(json["magnetic"].is_null());
  EXPECT_EQ(json["estimators"].size(), 2U);
}

TEST(RunReport, TheTableTellsWhatABatchBeganWithAndWhatNobodyLookedAt) {
  RunSummary refined;
  refined.estimator = "smoother";
  refined.truth = TruthFigures{{}, 0.01, 0.01, 0.04, 0.2, 1.1, true};
  refined.saw_lidar = true;
  refined.degenerate_scans = 17;
  for (const char* name : {"causal", "smoothed", "batch"})
    refined.stages.push_back({name, 0.02, 0.05, {}, 0.3, {}, {}});
  const std::string table = ab_table({refined});
  EXPECT_THAT(table, HasSubstr("smoother (batch)"));
  EXPECT_THAT(table, HasSubstr("  smoothed"));
  EXPECT_THAT(table, testing::ContainsRegex(" 17 +- "));  // no field: nothing was rejected, and nothing taken
  refined.stages.pop_back();
  EXPECT_THAT(ab_table({refined}), testing::Not(HasSubstr("(batch)")));
}

TEST(EstimateFiles, WriteNoFigureWhereNothingWasMeasured) {
  const TemporaryFolder folder;
  EstimateFiles files(folder.path());
  Estimate estimate;
  estimate.time = from_seconds(1.0);
  files.causal(estimate);
  Diagnostics& seen = estimate.diagnostics;
  seen.points = 100;
  seen.correspondences = 50;
  seen.inlier_share = 0.5;
  seen.lidar_nis = 1.25;
  seen.direction_sigma_m = Vector6::Constant(0.25);
  seen.magnetic_samples = 4;
  seen.magnetic_nis = 0.75;
  seen.clock_sigma_s = 0.125;
  seen.place_points = 200;
  seen.field_odds = -3.5;
  estimate.time = from_seconds(1.1);
  files.causal(estimate);
  files.finish("");
  const CsvTable table(folder / "diagnostics.csv");
  for (const char* column : {"inlier_share", "lidar_rmse_m", "lidar_nis", "direction_1_sigma_m", "direction_6_weight",
                             "magnetic_weight", "magnetic_shrink", "magnetic_residual_ut", "magnetic_nis",
                             "place_share", "decoy_share", "field_odds", "clock_offset_s", "clock_sigma_s"}) {
    EXPECT_EQ(table.texts(column)[0], "nan") << column;
    EXPECT_TRUE(std::isfinite(table.numbers(column)[1])) << column;
  }
  // Counts are zero, not unknown.
  for (const char* column :
       {"points", "correspondences", "degenerate_directions", "magnetic_samples", "magnetic_rejected"}) {
    EXPECT_EQ(table.numbers(column)[0], 0.0) << column;
  }
}

}  // namespace
}  // namespace lodestone
