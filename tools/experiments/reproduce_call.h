#pragma once

#include "tools/experiments/experiment_call.h"

/// `lodestone reproduce`: an experiment's runs, tables, figures and report.
namespace lodestone::reproduce {

/// Runs the missing steps, then writes tables, figures, reproduce.json and the report of all finished runs. Returns the
/// exit code: input_error if a step failed. Throws InputError if the call or a file is wrong, Interrupted on a signal.
int execute(const ExperimentCall& call);

}  // namespace lodestone::reproduce
