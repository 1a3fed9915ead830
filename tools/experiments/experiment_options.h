#pragma once

#include <string>

#include "tools/experiments/experiment_call.h"

namespace CLI {
class App;
}

namespace lodestone {

/// What tells the commands that run experiments apart in their help.
struct ExperimentWords {
  std::string positional;  ///< the name of the file's place on the command line
  std::string noun;        ///< "experiment"
  std::string folder;      ///< below config/
  std::string only;        ///< what --only takes
  std::string list;        ///< what --list shows
};

/// Adds the options of a command that runs an experiment. `call` must live as long as the command.
void add_experiment_options(CLI::App& command, const ExperimentWords& words, reproduce::ExperimentCall& call);

}  // namespace lodestone
