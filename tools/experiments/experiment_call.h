#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lodestone::reproduce {

/// Command line of `lodestone reproduce` and `lodestone ablate`.
struct ExperimentCall {
  std::string experiment;  ///< name or path of an experiment; for `ablate`, of an ablation
  std::string out;
  std::vector<std::string> only;
  std::vector<int> seeds;
  bool quick = false;
  bool list = false;
  bool any_build = false;
  std::optional<int> jobs;
  std::string profile;  ///< of Snakemake, for a cluster
};

}  // namespace lodestone::reproduce
