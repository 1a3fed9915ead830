#include <gmock/gmock.h>

#include <fstream>

#include "core/error.h"
#include "tests/tools/experiments/experiment_files.h"
#include "tools/experiments/lost_runs.h"
#include "tools/experiments/table_files.h"

namespace lodestone::reproduce {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ReproduceTableFiles, EscapeWhatTheirFormatsReserve) {
  const ResultTable table{
      "t", "100 % of a_b & c", {"a|b", "x, \"y\""}, {{"50 %", "1 µT ≤ 2"}, {"\\a{b}^~#$", "plain"}}, ""};
  EXPECT_EQ(to_csv(table), "a|b,\"x, \"\"y\"\"\"\n50 %,1 µT ≤ 2\n\\a{b}^~#$,plain\n");
  EXPECT_THAT(to_markdown(table), HasSubstr("| a\\|b | x, \"y\" |\n|---|---|\n| 50 % | 1 µT ≤ 2 |\n"));
  const std::string latex = to_latex(table);
  EXPECT_THAT(latex, HasSubstr("\\caption{100 \\% of a\\_b \\& c}"));
  EXPECT_THAT(latex, HasSubstr("\\begin{tabular}{lr}"));
  EXPECT_THAT(latex, HasSubstr("50 \\% & 1 $\\mu$T $\\le$ 2 \\\\\n"));
  EXPECT_THAT(latex, HasSubstr("\\textbackslash{}a\\{b\\}\\textasciicircum{}\\textasciitilde{}\\#\\$ & plain"));
  for (const char letter : latex) EXPECT_LT(static_cast<unsigned char>(letter), 128) << latex;
}

/// Hand-written results in the folders of runs.
class ReproduceTables : public testing::Test {
 protected:
  /// Writes a finished run with these figures; the figures of its other estimators are unknown unless they are written
  /// too.
  void put(const std::string& run, const std::string& estimator, double ate, bool success = true) {
    for (const char* other : {"smoother", "ieskf"}) {
      const std::filesystem::path place = folder_ / "runs" / run / other;
      std::filesystem::create_directories(place);
      if (!std::filesystem::exists(place / "summary.json")) std::ofstream(place / "summary.json") << "{}";
    }
    const std::filesystem::path folder = folder_ / "runs" / run / estimator;
    std::ofstream(folder / "summary.json")
        << "{\"estimator\": \"" << estimator << "\", \"ate_m\": " << ate
        << ", \"nees_pose\": null, \"success\": " << (success ? "true" : "false") << "}";
    for (std::size_t i = 0; i < plan_.runs.size(); ++i) done_[i] = done_[i] || plan_.runs[i].name == run;
  }
  Results results() const { return Results(plan_, folder_.path(), done_); }
  std::string result(const std::string& criterion) const {
    for (const auto& row : criteria_table(experiment_, results()).rows) {
      if (row.front() == criterion) return row.back();
    }
    return "no such criterion";
  }

  TemporaryFolder folder_;
  Experiment experiment_ = load_experiment(write_yard(folder_), false);
  Plan plan_ = make_plan(experiment_, "");
  std::vector<bool> done_ = std::vector<bool>(plan_.runs.size(), false);
};

TEST_F(ReproduceTables, ShowMeansRatiosLostAndMissing) {
  put("ways/yard-out-30m/seed1", "smoother", 0.1);
  put("ways/yard-out-30m/seed1", "ieskf", 0.2);
  put("ways/yard-out-30m/seed2", "smoother", 0.3);
  const ResultTable table = make_table(experiment_.tables.front(), experiment_, results());
  EXPECT_THAT(table.header, ElementsAre("world", "sequence", "range m", "theirs", "smoother ate_m mean",
                                        "ieskf ate_m mean", "smoother / ieskf ate_m mean", "smoother success mean"));
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_THAT(table.rows[0], ElementsAre("yard", "out", "30", "0.5", "0.2000", "0.2000", "0.50", "2/2"));
  EXPECT_THAT(table.rows[1], ElementsAre("yard", "out", "5", "/", "…", "…", "…", "…"));
  put("ways/yard-out-30m/seed2", "smoother", 9.0, false);
  EXPECT_THAT(make_table(experiment_.tables.front(), experiment_, results()).rows[0],
              ElementsAre("yard", "out", "30", "0.5", "/", "0.2000", "0.50", "1/2"));
}

/// The divisor is the best of the other estimators of the same run that are not lost.
TEST_F(ReproduceTables, TheBestOfTheOthersIsADivisor) {
  for (auto& run : plan_.runs) run.estimators = {"smoother", "ieskf", "magnetic"};
  const auto ratio = [&] {
    return *seed_value(results(), "ways", "yard-out-30m", "smoother", "ate_m", Statistic::worst, {kBestOfOthers, ""})
                .value;
  };
  std::filesystem::create_directories(folder_ / "runs/ways/yard-out-30m/seed1/magnetic");
  put("ways/yard-out-30m/seed1", "smoother", 0.1);
  put("ways/yard-out-30m/seed1", "ieskf", 0.4);
  put("ways/yard-out-30m/seed1", "magnetic", 0.2);
  EXPECT_DOUBLE_EQ(ratio(), 0.5);
  put("ways/yard-out-30m/seed1", "magnetic", 0.01, false);
  EXPECT_DOUBLE_EQ(ratio(), 0.25);
  put("ways/yard-out-30m/seed1", "ieskf", 0.01, false);
  EXPECT_EQ(ratio(), 0.0);
}

TEST_F(ReproduceTables, ShowTheSameRowOfAnotherGroup) {
  Group other = experiment_.groups.front();
  other.name = "others";
  experiment_.groups.push_back(other);
  plan_ = make_plan(experiment_, "");
  done_.assign(plan_.runs.size(), false);
  put("ways/yard-out-30m/seed1", "smoother", 0.1);
  put("others/yard-out-30m/seed1", "smoother", 0.7);
  TableChoice choice{"t", "t", "ways", "", std::vector<TableColumn>(2)};
  for (TableColumn& column : choice.columns) column.estimator = "smoother";
  choice.columns[1].group = "others";
  EXPECT_THAT(make_table(choice, experiment_, results()).rows[0], ElementsAre("yard", "out", "30", "0.1000", "0.7000"));
}

TEST_F(ReproduceTables, TellWhenAndWhyARunWasLost) {
  put("ways/yard-out-30m/seed1", "smoother", 0.1);
  put("ways/yard-out-30m/seed1", "ieskf", 5.0, false);
  EXPECT_THROW(lost_runs_table(results(), folder_.path()), InputError);  // diagnostics.csv is missing
  const std::filesystem::path run = folder_ / "runs/ways/yard-out-30m/seed1/ieskf";
  std::ofstream(run / "diagnostics.csv") << "t_s\n100.5\n100.6\n";
  std::ofstream(run / "errors.csv") << "t_s,error_x_m,error_y_m,error_z_m,error_m,heading_error_deg,position_sigma_m\n"
                                       "100.5,0,0,0,0.2,0,0.1\n101.25,0,0,0,1.5,0,0.1\n";
  std::ofstream(run / "summary.json") << R"({"success": false, "status": "lost", "lost": [{"from_s": "102.5"}],
      "warnings": {"run.lost": {"first": "lost from 102.5 s on: scans do not fit the cloud map there"}}})";
  const ResultTable table = lost_runs_table(results(), folder_.path());
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_THAT(table.rows[0], ElementsAre("ways/yard-out-30m/seed1", "ieskf", "lost", "0.8", "2.0",
                                         "scans do not fit the cloud map there"));
  std::ofstream(run / "summary.json") << R"({"success": false, "status": "lost", "scans": 0, "lost": []})";
  EXPECT_THAT(lost_runs_table(results(), folder_.path()).rows[0],
              ElementsAre("ways/yard-out-30m/seed1", "ieskf", "lost", "-", "-", "-"));
}

TEST_F(ReproduceTables, WorstIsTheLargestErrorAndTheLeastSuccess) {
  put("ways/yard-out-30m/seed1", "smoother", 0.1);
  put("ways/yard-out-30m/seed2", "smoother", 0.3, false);
  const auto worst = [&](const std::string& figure) {
    return *seed_value(results(), "ways", "yard-out-30m", "smoother", figure, Statistic::worst).value;
  };
  EXPECT_EQ(worst("ate_m"), 0.3);
  EXPECT_EQ(worst("success"), 0.0);
}

TEST_F(ReproduceTables, CoverageAndCalibrationAreColumns) {
  const auto put_summary = [&](const std::string& run, double within, double calibration, bool success) {
    put(run, "smoother", 0.1, success);
    std::ofstream(folder_ / "runs" / run / "smoother" / "summary.json")
        << R"({"ate_m": 0.1, "calibration": {"parameters": 7, "nees": )" << calibration
        << R"(}, "stages": {"batch": {"share_within_100mm": )" << within << R"(}}, "success": )"
        << (success ? "true}" : "false}");
  };
  put_summary("ways/yard-out-30m/seed1", 0.5, 1.5, true);
  put_summary("ways/yard-out-30m/seed2", 0.25, 2.5, true);
  TableChoice choice{"t", "t", "ways", "", std::vector<TableColumn>(3)};
  for (TableColumn& column : choice.columns) column.estimator = "smoother";
  choice.columns[0].figure = choice.columns[1].figure = "stages.batch.share_within_100mm";
  choice.columns[1].statistic = Statistic::worst;
  choice.columns[2].figure = "calibration.nees";
  EXPECT_THAT(make_table(choice, experiment_, results()).rows[0],
              ElementsAre("yard", "out", "30", "0.3750", "0.2500", "2.0000"));
  // The share of a lost run is meaningful; its other figures are not.
  put_summary("ways/yard-out-30m/seed2", 0.25, 2.5, false);
  EXPECT_THAT(make_table(choice, experiment_, results()).rows[0],
              ElementsAre("yard", "out", "30", "0.3750", "0.2500", "/"));
}

TEST_F(ReproduceTables, CriteriaAreMetMissedOrOpen) {
  EXPECT_THAT(result("reaches the end"), HasSubstr("open"));
  put("ways/yard-out-30m/seed1", "smoother", 0.1);
  EXPECT_THAT(result("reaches the end"), HasSubstr("open"));  // one seed of two
  put("ways/yard-out-30m/seed2", "smoother", 0.4);
  EXPECT_THAT(result("as good as theirs"), HasSubstr("open: 1 of 2 rows"));
  EXPECT_EQ(result("impossible"), "missed");  // for any result of the open rows
  put("ways/yard-out-5m/seed1", "smoother", 7.0);
  put("ways/yard-out-5m/seed2", "smoother", 7.0);
  EXPECT_EQ(result("reaches the end"), "met");
  EXPECT_EQ(result("as good as theirs"), "met");  // the published method is lost where the estimator has 7 m
  put("ways/yard-out-30m/seed2", "smoother", 0.6);
  EXPECT_EQ(result("as good as theirs"), "missed");  // the worst seed counts
  put("ways/yard-out-5m/seed2", "smoother", 7.0, false);
  EXPECT_EQ(result("reaches the end"), "missed");
}

TEST_F(ReproduceTables, SpreadIsAcrossRows) {
  Criterion spread;
  spread.title = "spread";
  spread.kind = CriterionKind::spread;
  spread.group = "days";
  spread.estimator = "smoother";
  spread.limit = 0.05;
  experiment_.criteria = {spread};
  put("days/yard-back-none/seed1", "smoother", 0.100);
  put("days/yard-back-none/seed1", "ieskf", 0.100);
  put("days/yard-back-monday/seed1", "smoother", 0.104);
  put("days/yard-back-monday/seed1", "ieskf", 0.300);
  EXPECT_EQ(result("spread"), "met");
  put("days/yard-back-monday/seed1", "smoother", 0.106);
  EXPECT_EQ(result("spread"), "missed");
}

TEST_F(ReproduceTables, MedianIsOfTheRowsMeantAndOfAnotherFigureToo) {
  Criterion median;
  median.title = "median";
  median.kind = CriterionKind::median;
  median.group = "days";
  median.estimator = "smoother";
  median.over = "ieskf";
  median.factor = 0.5;
  experiment_.criteria = {median};
  put("days/yard-back-none/seed1", "smoother", 0.1);
  put("days/yard-back-none/seed1", "ieskf", 1.0);
  put("days/yard-back-monday/seed1", "smoother", 0.7);
  put("days/yard-back-monday/seed1", "ieskf", 1.0);
  EXPECT_EQ(result("median"), "met");  // 0.4
  experiment_.criteria[0].factor = 0.39;
  EXPECT_EQ(result("median"), "missed");
  experiment_.criteria[0].only = {"*-none"};
  EXPECT_EQ(result("median"), "met");                 // 0.1
  experiment_.criteria[0].over_figure = "nees_pose";  // which no run provides
  EXPECT_EQ(result("median"), "open: 0 of 1 rows ran");
}

TEST_F(ReproduceTables, RowsWantedAndFactor) {
  experiment_.criteria.resize(1);
  experiment_.criteria[0] = {};
  experiment_.criteria[0].title = "ratio";
  experiment_.criteria[0].group = "days";
  experiment_.criteria[0].estimator = "smoother";
  experiment_.criteria[0].over = "ieskf";
  for (const char* row : {"none", "monday"}) {
    put(std::string("days/yard-back-") + row + "/seed1", "ieskf", 1.0);
    put(std::string("days/yard-back-") + row + "/seed1", "smoother", row[0] == 'n' ? 0.9 : 1.05);
  }
  EXPECT_EQ(result("ratio"), "missed");
  experiment_.criteria[0].rows = 1;
  EXPECT_EQ(result("ratio"), "met");
  experiment_.criteria[0].rows.reset();
  experiment_.criteria[0].factor = 1.1;
  EXPECT_EQ(result("ratio"), "met");
}

}  // namespace
}  // namespace lodestone::reproduce
