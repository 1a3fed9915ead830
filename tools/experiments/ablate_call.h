#pragma once

#include "tools/experiments/ablation.h"
#include "tools/experiments/experiment_options.h"

namespace lodestone::ablation {

/// The runs that match the ablation's patterns (`only`: variants, drives, worlds, sequences, VARIANT/DRIVE/seedN or its
/// beginning), and the baseline's runs under the same conditions, as an experiment. Throws InputError for a pattern
/// without a match.
reproduce::Experiment meant_runs(const Ablation& ablation);

/// Runs the missing steps, then writes tables, runs and picture of all finished runs. Returns the exit code:
/// input_error if a step failed. Throws InputError if the call or a file is wrong, Interrupted on a signal.
int execute(const reproduce::ExperimentCall& call);

}  // namespace lodestone::ablation
