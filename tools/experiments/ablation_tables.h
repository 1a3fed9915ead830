#pragma once

#include "tools/experiments/pairs.h"
#include "tools/experiments/tables.h"

namespace lodestone::ablation {

/// A row a variant: how its ATE compares with the baseline's, with confidence intervals, and its other figures. "…":
/// not run yet; "-": nothing to compare.
reproduce::ResultTable summary_table(const Ablation& ablation, const reproduce::Results& results);

/// A row a variant, a column a drive: of the baseline its ATE in metres, of the others the ratio to it, over the seeds.
/// "/": lost with some seed.
reproduce::ResultTable drives_table(const Ablation& ablation, const reproduce::Results& results);

/// One row a run, with the values of all switches and every figure of its summary.json: for other programs.
reproduce::ResultTable tidy_table(const Ablation& ablation, const reproduce::Results& results,
                                  const std::vector<std::string>& status);

}  // namespace lodestone::ablation
