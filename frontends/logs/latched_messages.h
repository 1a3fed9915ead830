#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Latched messages at the begin of a part of a log: a node that subscribes at that time receives earlier messages.
/// In ROS 1, the sender is recorded: the last message of each latching node counts. In ROS 2, the sender is unknown:
/// all messages of a latched topic (durability transient_local) count, because several nodes may have sent one each,
/// e.g. on /tf_static. For sensor types, only the last message counts.
///
/// Memory is limited to 100 messages, or 64 MB, per topic, but always keeps the last.
class LatchedMessages {
 public:
  /// `topics`: the topics to which the messages' indices refer; they must outlive this.
  explicit LatchedMessages(const std::vector<const TopicInfo*>& topics);

  /// Adds a message before the part, in the order of the log; kept if it is latched.
  void add(const RawMessage& message);

  /// The currently latched messages, with record time `time`, in their order of arrival. The views are valid until the
  /// next call of add().
  std::vector<RawMessage> recorded_at(Time time) const;

  /// Counts dropped messages in `warnings`: log.latched_left_out. `path` names the log.
  void report(const std::string& path, WarningLog& warnings) const;

 private:
  struct Kept {
    std::int64_t place = 0;  ///< position in the order of the log
    const Publisher* publisher = nullptr;
    std::vector<std::uint8_t> bytes;
  };
  struct Topic {
    const TopicInfo* info = nullptr;
    bool latches = false;    ///< from the QoS profiles
    bool last_only = false;  ///< keep only the last of the messages without sender
    std::deque<Kept> kept;
    std::size_t bytes = 0;
    std::int64_t left_out = 0;
    Time last_left_out = 0;
  };

  std::vector<Topic> topics_;
  std::int64_t next_place_ = 0;
};

}  // namespace lodestone
