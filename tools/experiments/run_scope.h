#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frontends/configuration/configuration_node.h"

namespace lodestone::reproduce {

/// How much is run of what a file describes.
struct RunScope {
  std::vector<int> seeds{1};
  std::vector<std::string> only;     ///< patterns of the runs that are meant; empty: all
  std::optional<double> duration_s;  ///< drives are cut after so long
};

/// The keys `seeds`, `only` and `duration_s` of a file; with `quick` those of its section `quick` are laid over them (a
/// mistake there shows in either case). Throws InputError where a value is wrong, or there is no such section.
RunScope read_scope(const ConfigurationNode& root, bool quick);

/// What a command line says instead; empty: as it is. Throws InputError for seeds that are negative or there twice.
void override_scope(RunScope& scope, const std::vector<std::string>& only, const std::vector<int>& seeds);

}  // namespace lodestone::reproduce
