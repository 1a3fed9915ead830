#pragma once

#include <map>
#include <string>
#include <vector>

#include "frontends/messages/message_paths.h"

namespace lodestone {

/// Fields of a type and of all that it is made of, by ROS 1's names (pkg/Type), from the text that logs carry: ROS 1's
/// definitions and ROS 2's (ros2msg). Constants are left out. Throws std::invalid_argument, in words, where the text is
/// of another kind (IDL), or a part's definition is missing.
std::map<std::string, std::vector<MessagePaths::Field>> parse_definition(const std::string& type,
                                                                         const std::string& text);

/// Definitions of common types, for logs that carry none; empty for others.
std::string common_definition(const std::string& type);

/// Bytes of a number as it stands in a message; 0 for what is none.
int size_of_number(const std::string& type);

}  // namespace lodestone
