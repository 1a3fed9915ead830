#pragma once

#include "tools/experiments/ablation.h"
#include "tools/experiments/experiment_call.h"

namespace lodestone::ablation {

/// The ablation's runs that its patterns (`only`: names of variants, drives, worlds, sequences, VARIANT/DRIVE/seedN or
/// the begin of one) mean, and those of the baseline under the same conditions, as an experiment. Throws InputError for
/// a pattern that means none.
reproduce::Experiment meant_runs(const Ablation& ablation);

/// Does what is missing and writes tables, runs and picture from what is there. Returns the exit code: input_error
/// where a step failed. Throws InputError where the call or a file is wrong, Interrupted on a signal.
int execute(const reproduce::ExperimentCall& call);

}  // namespace lodestone::ablation
