#pragma once

#include <string>
#include <vector>

#include "tools/experiments/experiment.h"

/// Common parts of the readers of experiments and ablations. All throw InputError with file, line and key.
namespace lodestone::reproduce {

/// Absolute path of the file that the node names, relative to the node's own file.
std::string path_beside(const ConfigurationNode& node);

/// The grade of reality under the key `grade`; empty if it is absent.
std::string read_grade(const ConfigurationNode& node);

/// The text of `key`, or `otherwise` if it is absent.
std::string text(const ConfigurationNode& node, const std::string& key, const std::string& otherwise = "");

/// The texts of the list `key`; empty if it is absent.
std::vector<std::string> texts(const ConfigurationNode& node, const std::string& key);

/// Throws if `name` is not in `known`, and suggests the nearest known name. `what`: "estimator", "row".
void require_known(const ConfigurationNode& node, const std::string& name, const std::vector<std::string>& known,
                   const std::string& what);

/// Names that become folders and files: only letters, digits, '-', '_' and '.' are allowed.
void check_file_name(const ConfigurationNode& node, const std::string& name);

/// Returns the node's text after the same check.
std::string file_name(const ConfigurationNode& node);

/// Adds the drives of the list `drives`: of each element `world` (relative to the file), `sequences`, `scene`,
/// `map_scenes`, `grade`.
void read_drives(const ConfigurationNode& node, std::vector<Drive>& drives);

/// LiDAR ranges, metres; empty if the key `ranges_m` is absent.
std::vector<double> read_ranges(const ConfigurationNode& node);

/// Throws if two rows of the group would have the same name.
void check_rows(const ConfigurationNode& node, const Group& group);

}  // namespace lodestone::reproduce
