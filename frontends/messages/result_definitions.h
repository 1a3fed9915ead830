#pragma once

#include <string>

namespace lodestone {

/// The definition of a type of result_messages.h with its dependencies, in the format of ROS 2's recorders (ros2msg).
/// Throws std::invalid_argument for other types.
std::string result_definition(const std::string& type);

}  // namespace lodestone
