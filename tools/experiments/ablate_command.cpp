#include <CLI/CLI.hpp>
#include <memory>

#include "tools/commands.h"
#include "tools/experiments/ablate_call.h"
#include "tools/experiments/experiment_options.h"

namespace lodestone {

namespace {

constexpr const char* kAblateExamples = R"(
Examples:
  lodestone ablate degeneracy --list
  lodestone ablate degeneracy --quick --out /tmp/quick
  lodestone ablate window --only 'tunnel-*' --seeds 1 --out /tmp/ablations
  lodestone ablate config/ablations/beta.yaml --out results/ablations --jobs 2

What is done is skipped: a call that was stopped goes on where it was, and ablations in one --out share runs and maps.
docs/user/ablations.md explains the tables and the format of an ablation.)";

}  // namespace

void add_ablate_command(CLI::App& app, int* code) {
  CLI::App* command = app.add_subcommand(
      "ablate", "Run the same drives with different options, and compare them pair by pair with a baseline");
  command->footer(kAblateExamples);
  const auto call = std::make_shared<reproduce::ExperimentCall>();
  add_experiment_options(
      *command,
      {"ABLATION", "ablation", "ablations",
       "run only these, with commas: variants, drives, worlds, sequences, VARIANT/DRIVE or VARIANT/DRIVE/seedN; "
       "* and ? match anything; the baseline runs under the same conditions",
       "list variants and drives, and exit"},
      *call);
  command->callback([call, code]() { *code = ablation::execute(*call); });
}

}  // namespace lodestone
