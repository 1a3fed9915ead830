#pragma once

#include <string>

#include "frontends/logs/message_source.h"

namespace lodestone {

/// The messages that Lodestone understands.
enum class MessageType { point_cloud, livox, imu, magnetic_field, other };

/// `type` as TopicInfo has it. Both generations of Livox' driver write the same message.
MessageType message_type(const std::string& type);

/// ROS 1's checksum of a known type: of another version of the message, the bytes mean something else. Empty for
/// `other`.
std::string expected_md5(MessageType type);

/// The type's definition as ROS 1's recorders store it. Its checksum is expected_md5(). Empty for `other`.
std::string ros1_definition(MessageType type);

/// The type's definition as ROS 2's recorders store it (ros2msg). Empty for `other`.
std::string ros2_definition(MessageType type);

/// A type's fields as text, and the language that it is in; both empty where nobody says.
struct TypeDefinition {
  std::string text, encoding;
};

/// What a log of ROS 2 holds of the topic's type: what its source says, else what is known of it.
TypeDefinition ros2_definition(const TopicInfo& topic);

}  // namespace lodestone
