#pragma once

#include <string>
#include <utility>
#include <vector>

#include "frontends/configuration/configuration_node.h"

/// Entries of an experiment file that are written once and read for each of several values
/// (docs/user/experiment-files.md).
namespace lodestone::reproduce {

/// The elements of a list. An element {for_each: {NAME: [values]}, entries: [...]} stands for its entries, all of them
/// with the first value, then all with the second. In an entry, {NAME} is the value; an entry with the key
/// `when: {NAME: [values]}` is read with these values only. Throws InputError.
std::vector<ConfigurationNode> repeated_entries(const ConfigurationNode& list);

/// The groups of a map by name. A group with the key `for_each: {NAME: [values]}` stands for one group for each value.
/// Throws InputError.
std::vector<std::pair<std::string, ConfigurationNode>> repeated_groups(const ConfigurationNode& groups);

}  // namespace lodestone::reproduce
