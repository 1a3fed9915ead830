#pragma once

#include <string>
#include <vector>

namespace lodestone {

/// The files of a ROS 2 bag, in the order of its metadata.yaml, in the same folder. Throws InputError if the file is
/// not such a description, or a listed file is missing.
std::vector<std::string> bag_files(const std::string& metadata);

}  // namespace lodestone
