// Files, figures and warnings of a run whose estimator is lost for a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontends/configuration/trajectory_file.h"
#include "tests/tools/run/stand_in.h"
#include "tools/writers/covariance_file.h"
#include "tools/writers/csv_table.h"

namespace lodestone {
namespace {

using testing::HasSubstr;
using LostRun = EstimatorRunTest;

TEST_F(LostRun, MarksARunThatLostTrack) {
  StandIn stand_in;
  stand_in.last_health = Health::lost;
  WarningLog warnings;
  const EstimatorOutcome outcome = run_estimator(run_with(stand_in), warnings);
  EXPECT_EQ(outcome.summary.status, RunStatus::lost);
  EXPECT_FALSE(outcome.summary.truth->success);
  EXPECT_EQ(warnings.count("run.lost"), 1);
  EXPECT_THAT(content_of(folder_ / "stand-in/trajectory.tum"), HasSubstr("# lost at 10.000000000 s"));
  EXPECT_THAT(ab_table({outcome.summary}), testing::ContainsRegex("stand-in +lost +100"));
  EXPECT_EQ(summary()["status"], "lost");
  EXPECT_FALSE(summary()["lost"][0]["regained"].get<bool>());
}

TEST_F(LostRun, PosesOfLostScansAreOmittedAndTheIntervalIsNamed) {
  StandIn stand_in;
  stand_in.lost = {31, 40};
  WarningLog warnings;
  const EstimatorOutcome outcome = run_estimator(run_with(stand_in), warnings);
  EXPECT_EQ(outcome.summary.status, RunStatus::regained);
  EXPECT_FALSE(outcome.summary.truth->success);
  for (const char* file : {"trajectory.tum", "causal.tum"}) {
    const Trajectory poses = read_trajectory((folder_ / "stand-in" / file).string());
    ASSERT_EQ(poses.size(), static_cast<std::size_t>(kScans - 10)) << file;
    EXPECT_EQ(poses[29].time, from_seconds(3.0)) << file;
    EXPECT_EQ(poses[30].time, from_seconds(4.1)) << file;
  }
  const std::string trajectory = content_of(folder_ / "stand-in/trajectory.tum");
  EXPECT_THAT(trajectory, HasSubstr("# lost from 3.100000000 to 4.000000000\n"));
  EXPECT_THAT(trajectory, testing::Not(HasSubstr("# lost at")));
  EXPECT_EQ(read_covariances(folder_ / "stand-in/covariance.csv").size(), static_cast<std::size_t>(kScans - 10));
  const CsvTable diagnostics(folder_ / "stand-in/diagnostics.csv");
  EXPECT_EQ(diagnostics.texts("health")[30], "lost");
  EXPECT_EQ(diagnostics.texts("health_reason")[30], "field_off_map");
  EXPECT_EQ(diagnostics.texts("health_reason")[40], "none");

  EXPECT_EQ(warnings.count("run.lost"), 1);
  EXPECT_THAT(warnings.entries().at("run.lost").first_detail,
              HasSubstr("lost from 3.100000000 s to 4.000000000 s, then found again: readings do not fit"));
  const nlohmann::json json = summary();
  EXPECT_EQ(json["status"], "regained");
  ASSERT_EQ(json["lost"].size(), 1U);
  EXPECT_EQ(json["lost"][0]["from_s"], "3.100000000");
  EXPECT_EQ(json["lost"][0]["to_s"], "4.000000000");
  EXPECT_TRUE(json["lost"][0]["regained"].get<bool>());
  EXPECT_THAT(ab_table({outcome.summary}), HasSubstr("regained 1 x"));
}

TEST_F(LostRun, ARunMayBeLostAgainAtTheEnd) {
  StandIn stand_in;
  stand_in.lost = {31, 40};
  stand_in.last_health = Health::lost;
  WarningLog warnings;
  const EstimatorOutcome outcome = run_estimator(run_with(stand_in), warnings);
  EXPECT_EQ(outcome.summary.status, RunStatus::lost);
  EXPECT_EQ(warnings.count("run.lost"), 2);
  EXPECT_EQ(summary()["lost"].size(), 2U);
  EXPECT_THAT(ab_table({outcome.summary}), HasSubstr("lost, regained 1 x"));
  EXPECT_THAT(content_of(folder_ / "stand-in/trajectory.tum"),
              testing::AllOf(HasSubstr("# lost from 3.1"), HasSubstr("# lost from 10.0"), HasSubstr("# lost at 10.0")));
}

}  // namespace
}  // namespace lodestone
