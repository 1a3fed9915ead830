#pragma once

#include <string>
#include <vector>

#include "tools/experiments/experiment.h"

/// What files of experiments and of ablations have in common. All throw InputError with file, line and key.
namespace lodestone::reproduce {

/// The text of `key`, or `otherwise` where it is absent.
std::string text(const ConfigurationNode& node, const std::string& key, const std::string& otherwise = "");

/// The texts of the list `key`; none where it is absent.
std::vector<std::string> texts(const ConfigurationNode& node, const std::string& key);

/// Fails, with the nearest right name, where `name` is not among `known`. `what`: "estimator", "row".
void require_known(const ConfigurationNode& node, const std::string& name, const std::vector<std::string>& known,
                   const std::string& what);

/// Names that become folders and files hold letters, digits, '-', '_' and '.' alone.
void check_file_name(const ConfigurationNode& node, const std::string& name);

/// The same of the node's own text, which is returned.
std::string file_name(const ConfigurationNode& node);

/// Adds the drives of the list `drives`: of each element `world` (relative to the file), `sequences`, `scene`,
/// `map_scenes`.
void read_drives(const ConfigurationNode& node, std::vector<Drive>& drives);

/// LiDAR ranges, metres; none where the key `ranges_m` is absent.
std::vector<double> read_ranges(const ConfigurationNode& node);

/// Fails where two rows of the group would have one name.
void check_rows(const ConfigurationNode& node, const Group& group);

}  // namespace lodestone::reproduce
