#pragma once

#include <string>
#include <utility>
#include <vector>

#include "frontends/configuration/configuration_node.h"

/// Entries of an experiment file that are written once and repeated for several values (docs/user/experiment-files.md).
namespace lodestone::reproduce {

/// The elements of a list. An element {for_each: {NAME: [values]}, entries: [...]} is replaced by its entries: all of
/// them with the first value, then all with the second. In an entry, {NAME} is replaced by the value; an entry with the
/// key `when: {NAME: [values]}` is used for these values only. Throws InputError.
std::vector<ConfigurationNode> repeated_entries(const ConfigurationNode& list);

/// The groups of a map by name. A group with the key `for_each: {NAME: [values]}` is replaced by one group per value.
/// Throws InputError.
std::vector<std::pair<std::string, ConfigurationNode>> repeated_groups(const ConfigurationNode& groups);

}  // namespace lodestone::reproduce
