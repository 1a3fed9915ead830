#pragma once

#include <string>
#include <vector>

namespace lodestone {

/// The files of a ROS 2 bag, as its metadata.yaml lists them, in order, found beside it. Throws InputError where the
/// file is no such description, or one of them is not there.
std::vector<std::string> bag_files(const std::string& metadata);

}  // namespace lodestone
