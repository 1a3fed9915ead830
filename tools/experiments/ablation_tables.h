#pragma once

#include "tools/experiments/pairs.h"
#include "tools/experiments/tables.h"

namespace lodestone::ablation {

/// One row per variant: its ATE compared with the baseline's, with confidence intervals, and its other figures. "…":
/// not run yet; "-": nothing to compare.
reproduce::ResultTable summary_table(const Ablation& ablation, const reproduce::Results& results);

/// One row per variant, one column per drive: the baseline's ATE in metres, for the others the ratio to it, over the
/// seeds. "/": lost with at least one seed.
reproduce::ResultTable drives_table(const Ablation& ablation, const reproduce::Results& results);

/// One row per run, with the values of all switches and every figure of its summary.json: for other programs.
reproduce::ResultTable tidy_table(const Ablation& ablation, const reproduce::Results& results,
                                  const std::vector<std::string>& status);

}  // namespace lodestone::ablation
