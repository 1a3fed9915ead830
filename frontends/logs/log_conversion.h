#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/log_writer.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// Of a log: what was recorded at `from` or later, and before `to`.
struct LogPart {
  Time from = std::numeric_limits<Time>::min();
  Time to = std::numeric_limits<Time>::max();

  bool has(Time time) const { return from <= time && time < to; }
};

/// What convert_log() did.
struct Conversion {
  std::int64_t messages = 0;
  std::int64_t latched = 0;                ///< of them, those from before the part
  std::vector<const TopicInfo*> left_out;  ///< the source's topics that only their own ROS understands
  WarningLog warnings;                     ///< log.latched_left_out
};

/// Copies the topics of a log that the writer's ROS understands, in order of record time: as they are where the log
/// speaks it already; else those of the types that Lodestone knows, field by field; of all that, what is in `part`,
/// which begins with what was latched before it (latched_messages.h), recorded when the part begins. `path` names the
/// log in messages, `progress` is called with each record time; the caller closes the writer. Throws InputError where
/// nothing can be written.
Conversion convert_log(const std::string& path, MessageSource& source, LogWriter& writer,
                       const std::function<void(Time)>& progress, const LogPart& part = {});

}  // namespace lodestone
