#pragma once

#include <string>

namespace lodestone {

/// A file of config/FOLDER (worlds, experiments, ablations): `name` itself if it is a path (contains '/' or ends in
/// .yaml), else config/FOLDER/NAME.yaml below the current folder, in the source tree, or in the installation's share
/// folder. `what`: "experiment", for the message. Throws InputError that lists the known names.
std::string find_shipped(const std::string& folder, const std::string& what, const std::string& name);

/// Path of `name` in tools/fleet of the source tree, or in the installation's share folder. Throws InputError if it is
/// in neither.
std::string find_fleet_file(const std::string& name);

}  // namespace lodestone
