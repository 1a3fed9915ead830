#pragma once

#include <string>

#include "tools/experiments/experiment_call.h"

namespace CLI {
class App;
}

namespace lodestone {

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
