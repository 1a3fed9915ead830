#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// What nodes have latched when a part of a log begins: who listens from then on gets it, though it was sent before.
/// ROS 1 says who sent a message: of each node that latches, its last one on a topic counts. ROS 2 does not: of a topic
/// that a node latches (durability transient_local) all count, for several nodes may have sent one each, as they do on
/// /tf_static; but only the last where a sensor's next message takes the place of the one before.
///
/// In memory are at most 100 messages, or 64 MB, of a topic, but always its last.
class LatchedMessages {
 public:
  /// `topics`: those that the messages' numbers stand for; they must outlive this.
  explicit LatchedMessages(const std::vector<const TopicInfo*>& topics);

  /// A message ahead of the part, in the order of the log; kept where it is latched.
  void take(const RawMessage& message);

  /// What is latched now, as if recorded at `time`, in the order in which it came. Views that hold until the next call
  /// of take().
  std::vector<RawMessage> recorded_at(Time time) const;

  /// Counts what did not fit in `warnings`: log.latched_left_out. `path` names the log.
  void tell(const std::string& path, WarningLog& warnings) const;

 private:
  struct Kept {
    std::int64_t place = 0;  ///< in the order of the log
    const Publisher* publisher = nullptr;
    std::vector<std::uint8_t> bytes;
  };
  struct Topic {
    const TopicInfo* info = nullptr;
    bool latches = false;    ///< by its QoS profiles
    bool last_only = false;  ///< of messages that do not say who sent them
    std::deque<Kept> kept;
    std::size_t bytes = 0;
    std::int64_t left_out = 0;
    Time last_left_out = 0;
  };

  std::vector<Topic> topics_;
  std::int64_t next_place_ = 0;
};

}  // namespace lodestone
