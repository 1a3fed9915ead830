#include <CLI/CLI.hpp>
#include <memory>

#include "tools/commands.h"
#include "tools/reproduce/reproduce_call.h"

namespace lodestone {

namespace {

constexpr const char* kExamples = R"(
Examples:
  lodestone reproduce paper --list
  lodestone reproduce paper --quick --out /tmp/quick
  lodestone reproduce paper --only 'accuracy/tunnel-*' --seeds 1 --out /tmp/tunnels
  lodestone reproduce config/experiments/paper.yaml --out results/paper --jobs 2

What is done is skipped: a call that was stopped goes on where it was. docs/reproduce.md says how to write an experiment.)";

}  // namespace

void add_reproduce_command(CLI::App& app, int* code) {
  CLI::App* command = app.add_subcommand(
      "reproduce", "Run an experiment: simulate worlds, build maps, localize, and write tables, figures and a report");
  command->footer(kExamples);
  const auto call = std::make_shared<reproduce::ReproduceCall>();
  command->add_option("EXPERIMENT", call->experiment, "a name in config/experiments, or a YAML file")->required();
  command->add_option("--out", call->out, "folder for the results; what is done there already is skipped");
  command
      ->add_option("--only", call->only,
                   "runs alone, with commas: names as --list gives them, groups, rows, worlds or sequences; * and ? stand "
                   "for anything")
      ->delimiter(',');
  command->add_option("--seeds", call->seeds, "instead of the experiment's, with commas")->delimiter(',');
  command->add_flag("--quick", call->quick, "the experiment's short form (its section quick)");
  command->add_option("--jobs", call->jobs, "steps at a time (default: one a core, at most 4); threads share the cores");
  command->add_flag("--any-build", call->any_build, "what another build of the program made counts as done");
  command->add_flag("--list", call->list, "list the runs, and end");
  command->callback([call, code]() { *code = reproduce::execute(*call); });
}

}  // namespace lodestone
