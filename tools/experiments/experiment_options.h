#pragma once

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace lodestone {

namespace reproduce {

/// Command line of `lodestone reproduce` and `lodestone ablate`.
struct ExperimentCall {
  std::string experiment;  ///< name or path of an experiment; for `ablate`, of an ablation
  std::string out;
  std::vector<std::string> only;
  std::vector<int> seeds;
  bool quick = false;
  bool list = false;
  bool any_build = false;
  std::optional<int> jobs;
  std::string profile;  ///< of Snakemake, for a cluster
};

}  // namespace reproduce

/// Words in the help of the commands that run experiments.
struct ExperimentWords {
  std::string positional;  ///< name of the file on the command line
  std::string noun;        ///< "experiment"
  std::string folder;      ///< below config/
  std::string only;        ///< help of --only
  std::string list;        ///< help of --list
};

/// Adds the options of a command that runs an experiment. `call` must live as long as the command.
void add_experiment_options(CLI::App& command, const ExperimentWords& words, reproduce::ExperimentCall& call);

}  // namespace lodestone
