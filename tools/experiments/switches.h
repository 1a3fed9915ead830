#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/ablation.h"

namespace lodestone::ablation {

/// Switches, sorted by command.
struct SortedSwitches {
  std::vector<std::string> run;    ///< key=value for `run --set`
  std::vector<std::string> map;    ///< for `map magnetic --set`
  std::vector<std::string> world;  ///< for `simulate --set`
  std::optional<double> noise_ut;
  std::string estimator;  ///< empty: not set
};

/// Throws InputError if the noise is not a number ≥ 0.
SortedSwitches sort_switches(const std::vector<Switch>& switches);

/// Throws InputError if an option of `run` or `map magnetic` is unknown, of the wrong type or out of range, or if an
/// estimator is unknown. Keys of worlds are checked when the worlds are read.
void check_switches(const std::vector<Switch>& switches);

}  // namespace lodestone::ablation
