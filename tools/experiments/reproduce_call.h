#pragma once

#include "tools/experiments/experiment_call.h"

/// `lodestone reproduce`: an experiment's runs, tables, figures and report.
namespace lodestone::reproduce {

/// Does what is missing and writes tables, figures, reproduce.json and the report from what is there. Returns the exit
/// code: input_error where a step failed. Throws InputError where the call or a file is wrong, Interrupted on a signal.
int execute(const ExperimentCall& call);

}  // namespace lodestone::reproduce
