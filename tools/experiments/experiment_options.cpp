#include "tools/experiments/experiment_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "tools/command_files.h"

namespace lodestone {

void add_experiment_options(CLI::App& command, const ExperimentWords& words, reproduce::ExperimentCall& call) {
  CommandFiles files(command);
  files
      .input(command.add_option(words.positional, call.experiment,
                                fmt::format("a name in config/{}, or a YAML file", words.folder)))
      ->required();
  files.output(
      command.add_option("--out", call.out, "folder for the results; steps that are finished there are skipped"));
  command.add_option("--only", call.only, words.only)->delimiter(',');
  command.add_option("--seeds", call.seeds, fmt::format("seeds instead of the {}'s, with commas", words.noun))
      ->delimiter(',');
  command.add_flag("--quick", call.quick, fmt::format("the {}'s short form (its section quick)", words.noun));
  command.add_option("--jobs", call.jobs,
                     "steps at a time (default: one per core, at most 4); their threads share the cores");
  files.input(
      command.add_option("--profile", call.profile,
                         "run the steps on a cluster: folder of a Snakemake profile, such as tools/fleet/slurm"));
  command.add_flag("--any-build", call.any_build, "accept finished steps of another build of the program");
  command.add_flag("--list", call.list, words.list);
}

}  // namespace lodestone
