#pragma once

#include <map>
#include <string>
#include <vector>

#include "frontends/messages/message_paths.h"

namespace lodestone {

/// Fields of a type and its parts, by ROS 1's names (pkg/Type), from the definition in a log: ROS 1's or ROS 2's
/// (ros2msg). Constants are ignored. Throws std::invalid_argument with the reason if the text has another format (IDL),
/// or a part's definition is missing.
std::map<std::string, std::vector<MessagePaths::Field>> parse_definition(const std::string& type,
                                                                         const std::string& text);

/// Bytes of a numeric type in a message; 0 for other types.
int size_of_number(const std::string& type);

}  // namespace lodestone
