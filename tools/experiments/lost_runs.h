#pragma once

#include <filesystem>

#include "tools/experiments/results.h"
#include "tools/experiments/tables.h"

namespace lodestone::reproduce {

/// One row per run and estimator without success: when the error first exceeds 1 m, when the estimator first says that
/// it is lost, and why. Times in seconds since the first scan. `root`: the experiment's output folder.
ResultTable lost_runs_table(const Results& results, const std::filesystem::path& root);

}  // namespace lodestone::reproduce
