#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/time.h"

namespace lodestone {

/// How the bytes of a message are laid out.
enum class Encoding {
  ros1,  ///< ROS 1: packed, little-endian
  cdr,   ///< ROS 2: CDR, aligned, with four bytes ahead that say the byte order
  other  ///< JSON, protobuf and the like: listed, never decoded
};

/// One topic of a log.
struct TopicInfo {
  std::string name;
  std::string type;  ///< as ROS 1 writes it, in both worlds: sensor_msgs/Imu, not sensor_msgs/msg/Imu
  Encoding encoding = Encoding::ros1;
  std::int64_t messages = 0;
  Time begin = 0;          ///< record time of the first message
  Time end = 0;            ///< record time of the last message
  std::string md5;         ///< ROS 1's checksum of the type; empty where the log says none
  std::string definition;  ///< the type's fields as text; empty where the log says none
  std::string
      definition_encoding{};  ///< of ROS 2: what language that is in, ros2msg or ros2idl; empty where the log says none
  /// What recorders of ROS 2 say besides, by MCAP's names: offered_qos_profiles, without which a latched topic is
  /// latched no more, topic_type_hash.
  std::map<std::string, std::string> metadata{};
};

/// The node of ROS 1 that sent a message. A latched topic may have several, each of which latches its own last message.
struct Publisher {
  std::string name;
  bool latching = false;
};

/// One message as its recorder got it. The bytes are a view that holds until the next call of the source.
struct RawMessage {
  Time record_time = 0;   ///< when it was recorded
  std::size_t topic = 0;  ///< index into the list given to select()
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;                  ///< bytes
  const Publisher* publisher = nullptr;  ///< lives as long as the source; null where the log does not say
};

/// A log of any kind: which topics it has, and their messages in order of record time. Streams: memory does not grow
/// with the log but for a small index. Knows nothing of sensors.
class MessageSource {
 public:
  virtual ~MessageSource() = default;

  /// In order of name; constant after construction.
  virtual const std::vector<TopicInfo>& topics() const = 0;

  /// Chooses the topics that next() returns, and starts from their first message. Throws InputError where one is
  /// absent.
  virtual void select(const std::vector<std::string>& names) = 0;

  /// The next message of the chosen topics; false at the end. Equal record times keep the file's order.
  /// Throws InputError where the log is damaged so that nothing can be read on.
  virtual bool next(RawMessage& message) = 0;
};

/// Adds messages, the first and last of them recorded at `begin` and `end`, to what is known of the topic.
inline void add_messages(TopicInfo& topic, Time begin, Time end, std::int64_t messages) {
  if (messages == 0) return;
  topic.begin = topic.messages == 0 || begin < topic.begin ? begin : topic.begin;
  topic.end = topic.messages == 0 || end > topic.end ? end : topic.end;
  topic.messages += messages;
}

}  // namespace lodestone
