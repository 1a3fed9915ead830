#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/experiments/experiment_options.h"
#include "tools/experiments/figures.h"
#include "tools/experiments/lost_runs.h"
#include "tools/experiments/plan_run.h"
#include "tools/experiments/reproduce_file.h"
#include "tools/experiments/table_files.h"
#include "tools/report/report.h"
#include "tools/table.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace reproduce {
namespace {

namespace fs = std::filesystem;

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
  write_text_file(root / "tables" / "runs.csv", to_csv(runs_table(results)));
  const std::vector<DrawnFigure> figures = draw_figures(experiment, results, root);
  write_text_file(root / "reproduce.json", to_json(experiment, results, work.status(), tables, figures));
  const fs::path report = root / "report.html";
  const std::size_t size = write_report(root, report);
  std::printf("\n%s: %.1f MB, opens from disk\n", report.c_str(), static_cast<double>(size) * 1e-6);
}

/// Runs the missing steps, then writes the results of all finished runs. Returns the exit code: input_error if a step
/// failed. Throws InputError if the call or a file is wrong, Interrupted on a signal.
int execute(const ExperimentCall& call) {
  const Experiment experiment = read_experiment(call);
  if (call.list) {
    const std::vector<Run> runs = list_runs(experiment);
    check_worlds(experiment, runs);
    print_runs(runs);
    return exit_code::done;
  }
  if (call.out.empty()) throw InputError("--out: expected a folder for the results (or --list)");
  PlanRun work(experiment, {call.out, call.any_build, call.jobs, call.profile});
  work.run();
  write_results(experiment, work);
  return work.exit_code();
}

}  // namespace
}  // namespace reproduce

namespace {

constexpr const char* kReproduceExamples = R"(
Examples:
  lodestone reproduce paper --list
  lodestone reproduce paper --quick --out /tmp/quick
  lodestone reproduce paper --only 'accuracy/tunnel-*' --seeds 1 --out /tmp/tunnels
  lodestone reproduce config/experiments/paper.yaml --out results/paper --jobs 2

Finished steps are skipped: an interrupted call continues when repeated.
docs/user/experiment-files.md describes the format.)";

}  // namespace

void add_reproduce_command(CLI::App& app, int* code) {
  CLI::App* command = app.add_subcommand(
      "reproduce", "Run an experiment: simulate worlds, build maps, localize, and write tables, figures and a report");
  command->footer(kReproduceExamples);
  const auto call = std::make_shared<reproduce::ExperimentCall>();
  add_experiment_options(
      *command,
      {"EXPERIMENT", "experiment", "experiments",
       "run only these, with commas: names of --list, groups, rows, worlds or sequences; * and ? match "
       "anything",
       "list the runs, and exit"},
      *call);
  command->callback([call, code]() { *code = reproduce::execute(*call); });
}

}  // namespace lodestone
