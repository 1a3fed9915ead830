#pragma once

#include <string>
#include <vector>

#include "frontends/messages/message_source.h"
#include "frontends/messages/ros_messages.h"

namespace lodestone {

/// Decodes supported messages to plain structs: ROS 1's serialization, and CDR in either byte order. The points of
/// clouds are views into the bytes.
class MessageDecoder {
 public:
  /// `source` names the log in messages.
  explicit MessageDecoder(std::string source) : source_(std::move(source)) {}

  /// `message` is valid until the next call and as long as the raw bytes. Throws InputError with topic and time if the
  /// type is not supported or of another version, or if the bytes are inconsistent.
  void decode(const TopicInfo& topic, const RawMessage& raw, ros1::Message& message);

 private:
  std::string source_;
  std::vector<std::uint8_t> points_;  ///< packed points of a Livox message in CDR
};

/// The same message in the other encoding, with all fields (except ROS 1's sequence number, which ROS 2 does not have).
/// Known types only. Throws InputError as decode() does.
std::vector<std::uint8_t> transcode(const std::string& source, const TopicInfo& topic, const RawMessage& raw,
                                    Encoding to);

}  // namespace lodestone
