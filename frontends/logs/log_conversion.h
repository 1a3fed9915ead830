#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/log_writer.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Part of a log: messages recorded at `from` or later, and before `to`.
struct LogPart {
  Time from = std::numeric_limits<Time>::min();
  Time to = std::numeric_limits<Time>::max();

  bool has(Time time) const { return from <= time && time < to; }
};

/// Result of convert_log().
struct Conversion {
  std::int64_t messages = 0;
  std::int64_t latched = 0;                ///< latched messages from before the part, included in `messages`
  std::vector<const TopicInfo*> left_out;  ///< topics that could not be converted
  WarningLog warnings;                     ///< log.latched_left_out
};

/// Copies the topics of a log that the writer's ROS supports, in order of record time. If the log is of the same ROS,
/// messages are copied unchanged; otherwise those of known types are converted field by field. Only messages in `part`
/// are copied, and at its begin the latched earlier messages (latched_messages.h). `path` names the log in messages;
/// `progress` is called with each record time. The caller closes the writer. Throws InputError if nothing can be
/// written.
Conversion convert_log(const std::string& path, MessageSource& source, LogWriter& writer,
                       const std::function<void(Time)>& progress, const LogPart& part = {});

}  // namespace lodestone
