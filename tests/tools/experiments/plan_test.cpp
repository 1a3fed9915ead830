#include "tools/experiments/plan.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "core/error.h"
#include "tests/tools/experiments/experiment_files.h"

namespace lodestone::reproduce {
namespace {

class ReproducePlan : public testing::Test {
 protected:
  void SetUp() override { experiment_.figures.clear(); }

  Plan plan(const std::string& program = "one build") const { return make_plan(experiment_, program); }

  static std::size_t count(const Plan& plan, StepKind kind) {
    return static_cast<std::size_t>(
        std::count_if(plan.steps.begin(), plan.steps.end(), [&](const Step& step) { return step.kind == kind; }));
  }

  static std::set<std::string> fingerprints(const Plan& plan) {
    std::set<std::string> all;
    for (const Step& step : plan.steps) all.insert(step.fingerprint);
    return all;
  }

  TemporaryFolder folder_;
  Experiment experiment_ = load_experiment(write_yard(folder_), false);
};

TEST_F(ReproducePlan, StepsThatRunsShareAreDoneOnce) {
  const Plan all = plan();
  EXPECT_EQ(all.runs.size(), 2U * 2U + 2U);
  EXPECT_EQ(count(all, StepKind::run), all.runs.size());
  EXPECT_EQ(count(all, StepKind::cloud), 2U);       // one per seed
  EXPECT_EQ(count(all, StepKind::log), 2U + 1U);    // one per drive and seed, for all ranges and maps
  EXPECT_EQ(count(all, StepKind::field), 2U + 2U);  // one per drive, seed and scene
  EXPECT_EQ(fingerprints(all).size(), all.steps.size());
}

TEST_F(ReproducePlan, StepsComeAfterWhatTheyNeedAndDriveByDrive) {
  const Plan all = plan();
  std::set<std::string> folders;
  for (std::size_t i = 0; i < all.steps.size(); ++i) {
    for (const std::size_t need : all.steps[i].needs) EXPECT_LT(need, i);
    EXPECT_TRUE(folders.insert(all.steps[i].folder).second);
  }
  // The first seed's runs of both groups come before the second seed's.
  std::vector<int> seeds;
  for (const Step& step : all.steps) {
    for (const auto& run : all.runs) {
      if (step.kind == StepKind::run && run.folder == step.folder) seeds.push_back(run.seed);
    }
  }
  EXPECT_TRUE(std::is_sorted(seeds.begin(), seeds.end()));
}

TEST_F(ReproducePlan, EstimatorsOfTheFirstSeedAloneRunWithItAlone) {
  for (const auto& run : plan().runs) EXPECT_EQ(run.estimators.size(), run.seed == 1 ? 2U : 1U) << run.name;
}

TEST_F(ReproducePlan, OnlyTakesNamesGroupsRowsAndPatterns) {
  const std::vector<std::pair<std::string, std::size_t>> cases{
      {"ways", 4},    {"ways/yard-out-5m", 2}, {"ways/yard-out-5m/seed2", 1},
      {"*/seed2", 2}, {"yard-back-monday", 1}, {"back", 2},
      {"yard", 6},    {"ways/*-30m/*", 2}};
  for (const auto& [pattern, runs] : cases) {
    experiment_.only = {pattern};
    const Plan some = plan();
    EXPECT_EQ(some.runs.size(), runs) << pattern;
    EXPECT_EQ(count(some, StepKind::run), runs) << pattern;
  }
  experiment_.only = {"ways", "wys"};
  EXPECT_THROW(plan(), InputError);
}

TEST_F(ReproducePlan, WhatAResultDependsOnChangesItsFingerprintAndNothingElse) {
  const std::set<std::string> before = fingerprints(plan());
  EXPECT_EQ(fingerprints(plan()), before);
  EXPECT_NE(fingerprints(plan("another build")), before);
  EXPECT_EQ(plan("another build").steps.front().recipe, plan().steps.front().recipe);

  // A changed run option changes the runs of its group, but not the simulations.
  experiment_.groups.front().run_settings = {"lidar.use=true"};
  std::size_t changed = 0;
  for (const std::string& fingerprint : fingerprints(plan())) changed += before.count(fingerprint) == 0 ? 1 : 0;
  EXPECT_EQ(changed, 4U);
  experiment_.groups.front().run_settings.clear();

  std::ofstream(folder_ / "yard.yaml", std::ios::app) << "# another word\n";
  for (const std::string& fingerprint : fingerprints(plan())) EXPECT_EQ(before.count(fingerprint), 0U);
}

TEST_F(ReproducePlan, GradesOfRealityShareNothingAndJudgeTheCalibration) {
  experiment_.groups.resize(1);
  experiment_.groups[0].name = "exact";
  for (Drive& drive : experiment_.groups[0].drives) drive.grade = "exact";
  experiment_.groups.push_back(experiment_.groups[0]);
  experiment_.groups[1].name = "field";
  for (Drive& drive : experiment_.groups[1].drives) drive.grade = "field";
  const Plan both = plan();
  EXPECT_EQ(count(both, StepKind::cloud), 2U * 2U);  // one per grade and seed
  EXPECT_EQ(count(both, StepKind::log), 2U * 2U);
  EXPECT_EQ(count(both, StepKind::field), 2U * 2U);
  EXPECT_EQ(fingerprints(both).size(), both.steps.size());
  const auto follows = [](const std::vector<std::string>& words, const std::string& option, const std::string& value) {
    const auto found = std::find(words.begin(), words.end(), option);
    return found != words.end() && found + 1 != words.end() && *(found + 1) == value;
  };
  for (const auto& run : both.runs) {
    EXPECT_EQ(run.grade, run.group);
    const Step& step = both.steps[run.step];
    const std::string log = both.steps[step.needs[1]].folder;
    EXPECT_TRUE(follows(step.commands.front(), "--calibration-truth", log + "/reality.yaml")) << run.name;
    for (const std::size_t need : step.needs)
      EXPECT_TRUE(follows(both.steps[need].commands.front(), "--reality", run.grade)) << both.steps[need].name;
  }
}

/// Groups that differ in the options of a run share its log and maps. The file of options counts by its content.
TEST_F(ReproducePlan, OptionsOfAFileAreAnInputOfTheRunsAlone) {
  const std::string options = (folder_ / "options.yaml").string();
  std::ofstream(options) << "magnetic: {beta: 0.3}\n";
  const std::size_t steps = plan().steps.size();
  experiment_.groups.push_back(experiment_.groups.front());
  experiment_.groups.back().name = "others";
  experiment_.groups.back().run_config = options;
  const Plan before = plan();
  EXPECT_EQ(before.steps.size(), steps + 4U);
  std::ofstream(options) << "magnetic: {beta: 0.4}\n";
  const Plan after = plan();
  for (std::size_t i = 0; i < after.steps.size(); ++i) {
    EXPECT_EQ(after.steps[i].fingerprint == before.steps[i].fingerprint, after.steps[i].inputs != std::vector{options})
        << after.steps[i].name;
  }
}

TEST_F(ReproducePlan, WithoutAGradeNothingIsSaidOfReality) {
  for (const Step& step : plan().steps) {
    for (const std::string& word : step.commands.front()) {
      EXPECT_NE(word, "--reality");
      EXPECT_NE(word, "--calibration-truth");
    }
  }
}

TEST_F(ReproducePlan, DifferencesOfMapsNeedTheMapsOfBothScenes) {
  experiment_.figures.push_back({FigureKind::map_difference, "changes", "", "", {"days"}, {}});
  const Plan all = plan();
  ASSERT_EQ(all.differences.size(), 2U);
  for (const MapDifference& difference : all.differences) {
    const Step& step = all.steps[difference.step];
    EXPECT_EQ(step.kind, StepKind::difference);
    EXPECT_EQ(step.needs.size(), 2U);
    for (const std::size_t need : step.needs) EXPECT_EQ(all.steps[need].kind, StepKind::field);
  }
  for (const Step& step : all.steps) {
    EXPECT_EQ(step.keep, step.kind == StepKind::field && step.folder.find("back") != std::string::npos) << step.name;
  }
  // The log's own scene, compared with itself.
  EXPECT_EQ(all.steps[all.differences[0].step].needs[0], all.steps[all.differences[0].step].needs[1]);
}

}  // namespace
}  // namespace lodestone::reproduce
