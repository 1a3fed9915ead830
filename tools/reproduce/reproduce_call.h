#pragma once

#include <optional>
#include <string>
#include <vector>

/// `lodestone reproduce`: an experiment's runs, tables, figures and report.
namespace lodestone::reproduce {

/// What `lodestone reproduce` was asked for, as on its command line.
struct ReproduceCall {
  std::string experiment;  ///< a name or a path
  std::string out;
  std::vector<std::string> only;
  std::vector<int> seeds;
  bool quick = false;
  bool list = false;
  bool any_build = false;
  std::optional<int> jobs;
};

/// Does what is missing and writes tables, figures, reproduce.json and the report from what is there. Returns the exit code:
/// input_error where a step failed. Throws InputError where the call or a file is wrong, Interrupted on a signal.
int execute(const ReproduceCall& call);

}  // namespace lodestone::reproduce
