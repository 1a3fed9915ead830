// `lodestone ablate` as called by users, in a yard that takes seconds.
#include <gmock/gmock.h>

#include <map>
#include <sstream>

#include "tests/tools/experiments/ablation_files.h"
#include "tools/writers/csv_table.h"

namespace lodestone::ablation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

class AblateCommand : public testing::Test {
 protected:
  void SetUp() override { ablation_ = write_yard(folder_); }

  ProgramResult ablate(const std::string& options) const {
    return run_lodestone("ablate " + ablation_ + " --out " + (folder_ / "out").string() + " " + options);
  }
  std::map<std::string, std::string> files(const std::string& folder) const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_ / "out" / folder))
      all[entry.path().filename()] = content_of(entry.path());
    return all;
  }
  CsvTable runs() const { return CsvTable(folder_ / "out/tables/yard-runs.csv"); }

  TemporaryFolder folder_;
  std::string ablation_;
};

TEST_F(AblateCommand, RunsComparesGoesOnAndGivesTheSameBytes) {
  const std::string quick = "--quick --jobs 2";
  const ProgramResult first = ablate(quick);
  ASSERT_EQ(first.code, 0) << first.errors;
  EXPECT_THAT(first.errors, HasSubstr(" 6 steps to do"));  // cloud, log, field, three runs
  EXPECT_THAT(first.output, HasSubstr("### Switches in a yard"));
  for (const char* name : {"yard.md", "yard.csv", "yard.tex", "yard-drives.md", "yard-runs.csv"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out/tables" / name)) << name;
  }
  const auto pictures = files("figures");
  EXPECT_EQ(pictures.size(), 3U);
  EXPECT_THAT(pictures.at("yard.svg"), HasSubstr(">one magnetometer</text>"));

  const CsvTable before = runs();
  EXPECT_THAT(before.texts("variant"), ElementsAre("as shipped", "no mask", "one magnetometer"));
  EXPECT_THAT(before.texts("magnetic.magnetometers"), ElementsAre("all", "all", "1"));
  const std::vector<double> ate = before.numbers("ate_m");
  EXPECT_NE(ate[2], ate[0]) << "fewer magnetometers make another trajectory";
  for (const double success : before.numbers("success")) EXPECT_EQ(success, 1.0);
  // The figures are those of the runs' summaries.
  const std::string summary = content_of(folder_ / "out" / before.texts("folder")[2] / "smoother/summary.json");
  EXPECT_THAT(summary, HasSubstr("\"ate_m\": " + CsvTable(folder_ / "out/tables/yard-runs.csv").texts("ate_m")[2]));

  // Nothing to do: all files keep their bytes and times.
  const auto tables = files("tables");
  const ProgramResult again = ablate(quick);
  EXPECT_EQ(again.code, 0);
  EXPECT_THAT(again.errors, HasSubstr(" 0 steps to do"));
  EXPECT_EQ(files("tables"), tables);
  EXPECT_EQ(files("figures"), pictures);

  // As if the call had been interrupted in one run: the run is repeated with the kept map, and gives the same figures.
  fs::remove(folder_ / "out" / before.texts("folder")[1] / "step.json");
  const ProgramResult resumed = ablate(quick);
  EXPECT_EQ(resumed.code, 0);
  EXPECT_THAT(resumed.errors, HasSubstr(" 3 steps to do"));  // cloud, log, run
  EXPECT_EQ(files("tables").at("yard-drives.csv"), tables.at("yard-drives.csv"));
  EXPECT_EQ(files("figures"), pictures);
  for (const char* figure : {"ate_m", "max_error_m", "heading_rmse_deg", "nees_pose"}) {
    EXPECT_EQ(runs().texts(figure), before.texts(figure));
  }

  // Another ablation in the same folder reuses common runs.
  std::string other = changed("name: yard", "name: other");
  other.replace(other.find("one magnetometer: {magnetic.magnetometers: 1}"), 45,
                "rear alone: {magnetic.magnetometers: rear}");
  write_yard(folder_, other);
  const ProgramResult shared = ablate(quick);
  EXPECT_EQ(shared.code, 0) << shared.errors;
  EXPECT_THAT(shared.errors, HasSubstr(" 3 steps to do"));
  EXPECT_EQ(files("tables").size(), 2U * tables.size());
}

TEST_F(AblateCommand, AFailingStepIsOneLineAndTheRestIsCompared) {
  write_yard(folder_, changed("magnetic.magnetometers: 1", "magnetic.magnetometers: 5"));
  const ProgramResult result = ablate("--quick");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("magnetic.magnetometers: expected 1 to 2"));
  EXPECT_THAT(result.output, HasSubstr("| no mask | 1 |"));
  EXPECT_THAT(result.output, HasSubstr("| one magnetometer | 0 of 1 |"));
  EXPECT_THAT(runs().texts("status"), ElementsAre("done", "done", "failed"));
}

TEST_F(AblateCommand, RefusesWrongCallsInOneLine) {
  const std::string out = " --out " + (folder_ / "out").string();
  expect_refused("ablate nothing" + out, "there is no ablation 'nothing' in config/ablations (known: ");
  expect_refused("ablate " + (folder_ / "nowhere.yaml").string() + out, "nowhere.yaml");
  expect_refused("ablate " + ablation_, "--out");
  expect_refused("ablate " + ablation_ + out + " --only 'no maks'", "did you mean 'no mask'?");
  expect_refused("ablate " + ablation_ + out + " --jobs 0", "--jobs");
  expect_refused("ablate " + ablation_ + out + " --seeds 1,1", "--seeds");
  write_yard(folder_, changed("degeneracy.rule: none", "world.sensors.lidra.rows: 8"));
  expect_refused("ablate " + ablation_ + out, "did you mean 'lidar'?");
  write_yard(folder_, changed("sequences: [out]", "sequences: [uot]"));
  expect_refused("ablate " + ablation_ + out, "there is no sequence 'uot'");
  expect_refused("ablate " + ablation_ + " --list", "there is no sequence 'uot'");
  std::filesystem::remove(folder_ / "yard.yaml");
  expect_refused("ablate " + ablation_ + " --list", "yard.yaml");
}

TEST_F(AblateCommand, ListsVariantsAndDrivesAndShowsExamples) {
  const ProgramResult list = run_lodestone("ablate " + ablation_ + " --list --only 'no mask/yard-out-5m'");
  EXPECT_EQ(list.code, 0) << list.errors;
  EXPECT_THAT(list.output, HasSubstr("as shipped (baseline)     2"));
  EXPECT_THAT(list.output, HasSubstr("degeneracy.rule=none"));
  EXPECT_THAT(list.output, HasSubstr("drives: yard-out-5m\n"));
  EXPECT_THAT(list.output, HasSubstr("4 runs"));
  EXPECT_THAT(run_lodestone("ablate --help").output, HasSubstr("lodestone ablate degeneracy --quick"));
}

}  // namespace
}  // namespace lodestone::ablation
