#include "tools/experiments/experiment.h"

#include <gmock/gmock.h>

#include <map>
#include <regex>

#include "core/error.h"
#include "tests/tools/experiments/experiment_files.h"
#include "tools/experiments/plan.h"

namespace lodestone::reproduce {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ReproduceExperiment, ReadsRowsEstimatorsAndPublishedFigures) {
  const TemporaryFolder folder;
  const Experiment experiment = load_experiment(write_yard(folder), false);
  ASSERT_EQ(experiment.groups.size(), 2U);
  const Group& ways = *experiment.find_group("ways");
  EXPECT_THAT(row_names(ways), ElementsAre("yard-out-30m", "yard-out-5m"));
  EXPECT_THAT(row_names(*experiment.find_group("days")), ElementsAre("yard-back-none", "yard-back-monday"));
  EXPECT_EQ(ways.drives.front().world, (folder / "yard.yaml").string());
  EXPECT_EQ(ways.estimators.back().seeds, SeedChoice::first);
  EXPECT_EQ(ways.published.find("yard-out-30m", "theirs")->value, 0.5);
  EXPECT_FALSE(ways.published.find("yard-out-5m", "theirs")->value.has_value());
  EXPECT_EQ(ways.published.find("yard-out-5m", "ours"), nullptr);
}

TEST(ReproduceExperiment, QuickIsLaidOverIt) {
  const TemporaryFolder folder;
  const std::string file = write_yard(folder);
  EXPECT_THAT(load_experiment(file, false).seeds, ElementsAre(1, 2));
  const Experiment quick = load_experiment(file, true);
  EXPECT_THAT(quick.seeds, ElementsAre(1));
  EXPECT_EQ(quick.duration_s, 3.0);
  EXPECT_THAT(quick.only, ElementsAre("ways/yard-out-30m"));
}

TEST(ReproduceExperiment, TheShippedExperimentOfRealityHasNineDrivesAtTwoRangesInFourGrades) {
  const Experiment experiment = load_experiment(find_experiment("reality"), false);
  std::vector<std::string> grades;
  for (const Group& group : experiment.groups) {
    grades.push_back(group.drives.front().grade);
    for (const Drive& drive : group.drives) EXPECT_EQ(drive.grade, group.name);
    EXPECT_EQ(row_names(group).size(), 18U);
    EXPECT_EQ(row_names(group), row_names(experiment.groups.front()));
  }
  EXPECT_THAT(grades, ElementsAre("exact", "calibrated", "field", "rough"));
  std::vector<std::string> tables;
  for (const TableChoice& table : experiment.tables) tables.push_back(table.name);
  ASSERT_EQ(tables.size(), 12U);
  EXPECT_THAT(std::vector(tables.begin(), tables.begin() + 4),
              ElementsAre("exact", "exact-coverage", "exact-consistency", "calibrated"));
  EXPECT_EQ(experiment.tables[2].columns.size() + 3, experiment.tables[5].columns.size());
  EXPECT_EQ(experiment.criteria.size(), 52U);
}

/// An experiment in two grades, written once. `entries`: of its tables.
std::string graded(const std::string& entries) {
  return R"(
estimators: [smoother]
groups:
  "{grade}": {for_each: {grade: [exact, field]}, grade: "{grade}", drives: [{world: yard.yaml, sequences: [out]}]}
tables:
  - {name: first, group: exact, columns: [{estimator: smoother}]}
  - for_each: {grade: [exact, field]}
    entries:
)" + entries +
         R"(
criteria:
  - for_each: {grade: [exact, field]}
    entries:
      - {title: "{grade}: reaches the end", group: "{grade}", estimator: smoother, figure: success, limit: 1}
)";
}

TEST(ReproduceExperiment, RepeatedEntriesAreReadOnceForEachValue) {
  const TemporaryFolder folder;
  const std::string entries =
      R"(      - {name: "{grade}", title: "of {grade}, {grade}", group: "{grade}", columns: [{estimator: smoother}]}
      - name: "{grade}-more"
        when: {grade: [field]}
        group: "{grade}"
        columns: [{estimator: smoother, figure: success}])";
  const Experiment experiment = load_experiment(write_yard(folder, graded(entries)), false);
  ASSERT_EQ(experiment.groups.size(), 2U);
  for (const Group& group : experiment.groups) {
    EXPECT_EQ(group.drives.front().grade, group.name);
    EXPECT_THAT(row_names(group), ElementsAre("yard-out"));
  }
  std::vector<std::string> tables;
  for (const TableChoice& table : experiment.tables) tables.push_back(table.name + " of " + table.group);
  EXPECT_THAT(tables, ElementsAre("first of exact", "exact of exact", "field of field", "field-more of field"));
  EXPECT_EQ(experiment.tables[2].title, "of field, field");
  ASSERT_EQ(experiment.criteria.size(), 2U);
  EXPECT_EQ(experiment.criteria[1].title, "field: reaches the end");
  EXPECT_EQ(experiment.criteria[1].group, "field");
}

TEST(ReproduceExperiment, ADriveMayHaveItsOwnGrade) {
  const TemporaryFolder folder;
  const Experiment experiment = load_experiment(write_yard(folder, R"(
estimators: [smoother]
groups:
  both:
    grade: field
    drives: [{world: yard.yaml, sequences: [out], grade: rough}, {world: yard.yaml, sequences: [back]}]
)"),
                                                false);
  std::vector<std::string> grades;
  for (const auto& run : list_runs(experiment)) grades.push_back(run.row + " " + run.grade);
  EXPECT_THAT(grades, ElementsAre("yard-out rough", "yard-back field"));
}

TEST(ReproduceExperiment, ThePapersRowsRunEverySystemAndThePapersRules) {
  const Experiment experiment = load_experiment(find_experiment("paper"), false);
  std::map<std::string, std::size_t> runs;
  for (const auto& run : list_runs(experiment)) {
    if (!run.first_seed) continue;
    ++runs[run.group];
    if (run.group == "accuracy") {
      EXPECT_EQ(run.estimators.size(), 9U) << run.name;  // eight systems and the smoother
    }
  }
  EXPECT_EQ(runs["accuracy"], 18U);
  EXPECT_EQ(runs["paper-rules"], 18U);
  EXPECT_EQ(runs["exact"], 18U);
  EXPECT_EQ(runs["long-term"], 6U);
  EXPECT_EQ(row_names(*experiment.find_group("accuracy")), row_names(*experiment.find_group("paper-rules")));
  EXPECT_EQ(row_names(*experiment.find_group("long-term")), row_names(*experiment.find_group("long-term-paper-rules")));
}

/// Every mistake is reported in one line with the file's name, the line and the correction.
TEST(ReproduceExperiment, MistakesAreOneLineWithTheirPlace) {
  const auto changed_in = [](std::string text, const std::string& from, const std::string& to) {
    EXPECT_NE(text.find(from), std::string::npos) << from;
    return text.replace(text.find(from), from.size(), to);
  };
  const auto changed = [&](const std::string& from, const std::string& to) {
    return changed_in(kYardExperiment, from, to);
  };
  const std::string repeated = graded(
      R"(      - {name: "{grade}", when: {grade: [field]}, group: "{grade}", columns: [{estimator: smoother}]})");
  const auto changed_block = [&](const std::string& from, const std::string& to) {
    return changed_in(repeated, from, to);
  };
  struct Case {
    std::string text;
    const char* expected_text;
  };
  for (const Case& wrong :
       {Case{changed("seeds: [1, 2]", "seed: [1, 2]"), "unknown key 'seed'; did you mean 'seeds'?"},
        Case{changed("seeds: first\n", "seeds: first\n    grade: feld\n"), "did you mean 'field'?"},
        Case{changed("seeds: first\n", "seeds: first\n    run_config: none.yaml\n"), "there is no file"},
        Case{changed("{estimator: ieskf},", "{estimator: ieskf, group: day},"), "did you mean 'days'?"},
        Case{changed("{published: theirs}, {", "{published: theirs, group: days}, {"), "requires 'estimator'"},
        Case{changed("[1, 2]", "[1, 1]"), "twice"},
        Case{changed("[1, 2]", "[]"), "at least one seed"},
        Case{changed("[smoother,", "[smother,"), "did you mean 'smoother'?"},
        Case{changed("yard-out-5m: ", "yard-out-6m: "), "did you mean 'yard-out-5m'?"},
        Case{changed("[\"/\"]", "[1, 2]"), "expected 1 values"},
        Case{changed("[\"/\"]", "[lost]"), "expected a number, found 'lost'"},
        Case{changed("group: ways, columns", "group: way, columns"), "did you mean 'ways'?"},
        Case{changed("over: ieskf", "over: ieskg"), "did you mean 'ieskf'?"},
        Case{changed("{published: theirs}, {", "{published: their}, {"), "did you mean 'theirs'?"},
        Case{changed("figure: success}", "figure: sucess}"), "did you mean 'success'?"},
        Case{changed("kind: at_least", "kind: least"), "did you mean 'at_least'?"},
        Case{changed("limit: 0}", "limit: 0, published: theirs}"), "one bound"},
        Case{changed("ranges_m: [30, 5]", "ranges_m: [30, -5]"), "above 0 m"},
        Case{changed("ranges_m: [30, 5]", "ranges_m: [30, 30]"), "two runs would be called"},
        Case{changed("sequences: [out]", "sequences: [../out]"), "letters, digits"},
        Case{changed("  ways:", "  w/ays:"), "letters, digits"},
        Case{changed("duration_s: 3", "duration: 3"), "duration_s"},
        Case{changed("group: days, columns", "group: days, when: {grade: [field]}, columns"), "unknown key 'when'"},
        Case{changed_block("    entries:", "    entry:"), "did you mean 'entries'?"},
        Case{changed_block("grade: \"{grade}\"", "grade: \"{grad}\""), "expected {grade} of 'for_each', found {grad}"},
        Case{changed_block("name: \"{grade}\"", "name: \"{grade\""), "expected {grade} of 'for_each', found {grade"},
        Case{changed_block("when: {grade: [field]}", "when: {grade: [feld]}"), "did you mean 'field'?"},
        Case{changed_block("when: {grade: [field]}", "when: {grad: [field]}"), "did you mean 'grade'?"},
        Case{changed_block("\"{grade}\": {for_each", "all: {for_each"), "the group 'all' appears twice"},
        Case{changed_block("for_each: {grade: [exact, field]}", "for_each: {grade: [field, field]}"), "twice"},
        Case{changed_block("for_each: {grade: [exact, field]}", "for_each: {grade: []}"), "at least one value"},
        Case{changed_block("for_each: {grade: [exact, field]}", "for_each: {}"), "expected one name"}}) {
    const TemporaryFolder folder;
    const std::string file = write_yard(folder, wrong.text);
    try {
      load_experiment(file, false);
      ADD_FAILURE() << "accepted, though: " << wrong.expected_text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(wrong.expected_text));
      EXPECT_TRUE(std::regex_search(error.what(), std::regex("^" + file + ":[0-9]+: "))) << error.what();
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
    }
  }
}

TEST(ReproduceExperiment, TheShippedOnesAreReadInBothForms) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(LODESTONE_SOURCE_DIR) + "/config/experiments")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    EXPECT_NO_THROW(load_experiment(entry.path().string(), false)) << entry.path();
    EXPECT_NO_THROW(load_experiment(entry.path().string(), true)) << entry.path();
    EXPECT_TRUE(std::filesystem::exists(find_experiment(entry.path().stem().string())));
  }
  EXPECT_GT(files, 0);
  EXPECT_THROW(find_experiment("no such experiment"), InputError);
}

}  // namespace
}  // namespace lodestone::reproduce
