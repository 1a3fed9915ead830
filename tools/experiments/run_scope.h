#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frontends/configuration/configuration_node.h"

namespace lodestone::reproduce {

/// The selected part of an experiment or ablation.
struct RunScope {
  std::vector<int> seeds{1};
  std::vector<std::string> only;     ///< patterns of the selected runs; empty: all
  std::optional<double> duration_s;  ///< length of the cut drives
};

/// The keys `seeds`, `only` and `duration_s` of a file; with `quick`, replaced by those of its section `quick` (checked
/// in either case). Throws InputError if a value is wrong, or the section is missing.
RunScope read_scope(const ConfigurationNode& root, bool quick);

/// Replaces values by those of the command line; empty: unchanged. Throws InputError for negative or repeated seeds.
void override_scope(RunScope& scope, const std::vector<std::string>& only, const std::vector<int>& seeds);

}  // namespace lodestone::reproduce
