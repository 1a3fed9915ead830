#pragma once

#include <string>

#include "frontends/messages/message_source.h"

namespace lodestone {

/// The message types that Lodestone supports.
enum class MessageType { point_cloud, livox, imu, magnetic_field, odometry, other };

/// `type` as in TopicInfo. Both Livox drivers write the same message.
MessageType message_type(const std::string& type);

/// ROS 1's checksum of a known type. Another checksum means another version with another layout. Empty for `other`.
std::string expected_md5(MessageType type);

/// The type's definition as ROS 1's recorders store it. Its checksum is expected_md5(). Empty for `other`.
std::string ros1_definition(MessageType type);

/// The type's definition as ROS 2's recorders store it (ros2msg). Empty for `other`.
std::string ros2_definition(MessageType type);

/// The same for types of results and other common types, with the header first. Empty for an unknown type.
std::string further_definition(const std::string& type);

/// A type's definition and its language; both empty if unknown.
struct TypeDefinition {
  std::string text, encoding;
};

/// The definition for a ROS 2 log of the topic's type: from the source, otherwise of the known type.
TypeDefinition ros2_definition(const TopicInfo& topic);

}  // namespace lodestone
