#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Converts "sensor_msgs/msg/Imu" of ROS 2 to "sensor_msgs/Imu"; other names are unchanged.
inline std::string ros1_type_name(std::string type) {
  const std::size_t at = type.find("/msg/");
  if (at != std::string::npos) type.erase(at, 4);
  return type;
}

/// The inverse: the name in a ROS 2 bag.
inline std::string ros2_type_name(std::string type) {
  const std::size_t at = type.find('/');
  if (at != std::string::npos && type.find('/', at + 1) == std::string::npos) type.insert(at, "/msg");
  return type;
}

inline Encoding parse_encoding(std::string_view name) {
  return name == "cdr" ? Encoding::cdr : name == "ros1" ? Encoding::ros1 : Encoding::other;
}

/// For each of `topics`, its index in `names`; -1 if it is not chosen. Throws InputError if a name is not a topic.
inline std::vector<int> selection_of(const std::vector<TopicInfo>& topics, const std::vector<std::string>& names,
                                     const std::string& path) {
  std::vector<int> selection(topics.size(), -1);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found =
        std::find_if(topics.begin(), topics.end(), [&](const TopicInfo& topic) { return topic.name == names[i]; });
    if (found == topics.end()) throw InputError(path + ": there is no topic " + names[i]);
    selection[static_cast<std::size_t>(found - topics.begin())] = static_cast<int>(i);
  }
  return selection;
}

}  // namespace lodestone
