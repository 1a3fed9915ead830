#include <CLI/CLI.hpp>
#include <memory>

#include "tools/ablate/ablate_call.h"
#include "tools/commands.h"

namespace lodestone {

namespace {

constexpr const char* kExamples = R"(
Examples:
  lodestone ablate degeneracy --list
  lodestone ablate degeneracy --quick --out /tmp/quick
  lodestone ablate window --only 'tunnel-*' --seeds 1 --out /tmp/ablations
  lodestone ablate config/ablations/beta.yaml --out results/ablations --jobs 2

What is done is skipped: a call that was stopped goes on where it was, and ablations in one --out share runs and maps.
docs/ablations.md says how to read the tables and how to write an ablation.)";

}  // namespace

void add_ablate_command(CLI::App& app, int* code) {
  CLI::App* command = app.add_subcommand(
      "ablate", "Run the same drives with switches set differently, and compare pair by pair with a baseline");
  command->footer(kExamples);
  const auto call = std::make_shared<ablation::AblateCall>();
  command->add_option("ABLATION", call->ablation, "a name in config/ablations, or a YAML file")->required();
  command->add_option("--out", call->out, "folder for the results; what is done there already is skipped");
  command
      ->add_option("--only", call->only,
                   "with commas: variants, drives, worlds, sequences, VARIANT/DRIVE or VARIANT/DRIVE/seedN; * and ? stand for "
                   "anything; the baseline runs with them")
      ->delimiter(',');
  command->add_option("--seeds", call->seeds, "instead of the ablation's, with commas")->delimiter(',');
  command->add_flag("--quick", call->quick, "the ablation's short form (its section quick)");
  command->add_option("--jobs", call->jobs, "steps at a time (default: one a core, at most 4); threads share the cores");
  command->add_flag("--any-build", call->any_build, "what another build of the program made counts as done");
  command->add_flag("--list", call->list, "list variants and drives, and end");
  command->callback([call, code]() { *code = ablation::execute(*call); });
}

}  // namespace lodestone
