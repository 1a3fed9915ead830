#pragma once

#include <string>
#include <vector>

#include "frontends/logs/message_source.h"
#include "frontends/logs/ros1/messages.h"

namespace lodestone {

/// Turns the bytes of the messages that Lodestone understands into plain structs: ROS 1's serialization and CDR in
/// either byte order. Clouds stay where they are: their points are views into the bytes.
class MessageDecoder {
 public:
  /// `source` names the log in messages.
  explicit MessageDecoder(std::string source) : source_(std::move(source)) {}

  /// `message` holds until the next call and as long as the raw bytes do. Throws InputError, with topic and time, where
  /// the type is none that is understood or of another version, or where the bytes contradict themselves.
  void decode(const TopicInfo& topic, const RawMessage& raw, ros1::Message& message);

 private:
  std::string source_;
  std::vector<std::uint8_t> points_;  ///< of a Livox' message in CDR, packed
};

/// The same message in the other encoding, all its fields kept (ROS 1's sequence number aside, which ROS 2 has not).
/// Known types only. Throws InputError as decode() does.
std::vector<std::uint8_t> transcode(const std::string& source, const TopicInfo& topic, const RawMessage& raw,
                                    Encoding to);

}  // namespace lodestone
