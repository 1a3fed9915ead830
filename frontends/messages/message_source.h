#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/time.h"

namespace lodestone {

/// The layout of a message's bytes.
enum class Encoding {
  ros1,  ///< ROS 1: packed, little-endian
  cdr,   ///< ROS 2: CDR, aligned, after four bytes with the byte order
  other  ///< e.g. JSON, protobuf: listed, never decoded
};

/// One topic of a log.
struct TopicInfo {
  std::string name;
  std::string type;  ///< in the form of ROS 1, also for ROS 2: sensor_msgs/Imu, not sensor_msgs/msg/Imu
  Encoding encoding = Encoding::ros1;
  std::int64_t messages = 0;
  Time begin = 0;                     ///< record time of the first message
  Time end = 0;                       ///< record time of the last message
  std::string md5;                    ///< ROS 1's checksum of the type; empty if unknown
  std::string definition;             ///< the type's fields as text; empty if unknown
  std::string definition_encoding{};  ///< of ROS 2: ros2msg or ros2idl; empty if unknown
  /// Further metadata of ROS 2 with MCAP's keys: offered_qos_profiles (required for latched topics), topic_type_hash.
  std::map<std::string, std::string> metadata{};
};

/// The ROS 1 node that sent a message. A latched topic may have several publishers; each latches its last message.
struct Publisher {
  std::string name;
  bool latching = false;
};

/// One recorded message. The bytes are a view that is valid until the next call of the source.
struct RawMessage {
  Time record_time = 0;   ///< time of recording
  std::size_t topic = 0;  ///< index into the list of select()
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;                  ///< bytes
  const Publisher* publisher = nullptr;  ///< lives as long as the source; null if unknown
};

/// A log of any format: its topics, and its messages in order of record time. Streams the messages: memory grows only
/// with a small index. Does not know sensors.
class MessageSource {
 public:
  virtual ~MessageSource() = default;

  /// In order of name; constant after construction.
  virtual const std::vector<TopicInfo>& topics() const = 0;

  /// Chooses the topics of next(), and restarts from the first message. Throws InputError if a topic is absent.
  virtual void select(const std::vector<std::string>& names) = 0;

  /// The next message of the chosen topics; false at the end. Equal record times keep the file's order. Throws
  /// InputError if damage of the log prevents further reading.
  virtual bool next(RawMessage& message) = 0;
};

/// Adds messages with record times from `begin` to `end` to the topic's statistics.
inline void add_messages(TopicInfo& topic, Time begin, Time end, std::int64_t messages) {
  if (messages == 0) return;
  topic.begin = topic.messages == 0 || begin < topic.begin ? begin : topic.begin;
  topic.end = topic.messages == 0 || end > topic.end ? end : topic.end;
  topic.messages += messages;
}

}  // namespace lodestone
