#include <CLI/CLI.hpp>
#include <memory>

#include "tools/commands.h"
#include "tools/experiments/experiment_options.h"
#include "tools/experiments/reproduce_call.h"

namespace lodestone {

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
