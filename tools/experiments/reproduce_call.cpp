#include "tools/experiments/reproduce_call.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/experiments/figures.h"
#include "tools/experiments/lost_runs.h"
#include "tools/experiments/plan_run.h"
#include "tools/experiments/reproduce_file.h"
#include "tools/experiments/table_files.h"
#include "tools/report/report.h"
#include "tools/table.h"
#include "tools/writers/output_folder.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

Experiment read_experiment(const ExperimentCall& call) {
  Experiment experiment = load_experiment(find_experiment(call.experiment), call.quick);
  override_scope(experiment, call.only, call.seeds);
  return experiment;
}

void print_runs(const std::vector<Run>& runs) {
  Table table({"run", "estimators"});
  for (const Run& run : runs) table.add({run.name, fmt::format("{}", fmt::join(run.estimators, ","))});
  std::printf("%s%zu runs\n", table.to_string().c_str(), runs.size());
}

/// Writes tables, figures, reproduce.json and report of all finished runs.
void write_results(const Experiment& experiment, const PlanRun& work) {
  const fs::path& root = work.root();
  const Results results(work.plan(), root, work.done());
  std::vector<ResultTable> tables;
  for (const TableChoice& table : experiment.tables) {
    if (!results.rows_of(table.group).empty()) tables.push_back(make_table(table, experiment, results));
  }
  if (!experiment.criteria.empty()) tables.push_back(criteria_table(experiment, results));
  if (ResultTable lost = lost_runs_table(results, root); !lost.rows.empty()) tables.push_back(std::move(lost));
  // Tables of an earlier call with other runs are deleted.
  emptied_folder(root / "tables");
  for (const ResultTable& table : tables) {
    write_table(root / "tables", table);
    std::printf("\n%s", to_markdown(table).c_str());
  }
  write_text_file((root / "tables" / "runs.csv").string(), to_csv(runs_table(results)));
  const std::vector<DrawnFigure> figures = draw_figures(experiment, results, root);
  write_text_file((root / "reproduce.json").string(), to_json(experiment, results, work.status(), tables, figures));
  const fs::path report = root / "report.html";
  const std::size_t size = write_report(root, report);
  std::printf("\n%s: %.1f MB, opens from disk\n", report.c_str(), static_cast<double>(size) * 1e-6);
}

}  // namespace

int execute(const ExperimentCall& call) {
  const Experiment experiment = read_experiment(call);
  if (call.list) {
    print_runs(list_runs(experiment));
    return exit_code::done;
  }
  if (call.out.empty()) throw InputError("--out: expected a folder for the results (or --list)");
  PlanRun work(experiment, {call.out, call.any_build, call.jobs, call.profile});
  work.run();
  write_results(experiment, work);
  return work.exit_code();
}

}  // namespace lodestone::reproduce
