#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lodestone::reproduce {

/// What `lodestone reproduce` and `lodestone ablate` were asked for, as on their command lines.
struct ExperimentCall {
  std::string experiment;  ///< a name or a path; of `ablate` an ablation's
  std::string out;
  std::vector<std::string> only;
  std::vector<int> seeds;
  bool quick = false;
  bool list = false;
  bool any_build = false;
  std::optional<int> jobs;
};

}  // namespace lodestone::reproduce
