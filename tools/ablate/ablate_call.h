#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/ablate/ablation.h"

namespace lodestone::ablation {

/// What `lodestone ablate` was asked for, as on its command line.
struct AblateCall {
  std::string ablation;  ///< a name or a path
  std::string out;
  std::vector<std::string> only;
  std::vector<int> seeds;
  bool quick = false;
  bool list = false;
  bool any_build = false;
  std::optional<int> jobs;
};

/// The ablation's runs that its patterns (`only`: names of variants, drives, worlds, sequences, VARIANT/DRIVE/seedN or the
/// begin of one) mean, and those of the baseline under the same conditions, as an experiment. Throws InputError for a pattern
/// that means none.
reproduce::Experiment meant_runs(const Ablation& ablation);

/// Does what is missing and writes tables, runs and picture from what is there. Returns the exit code: input_error where a
/// step failed. Throws InputError where the call or a file is wrong, Interrupted on a signal.
int execute(const AblateCall& call);

}  // namespace lodestone::ablation
