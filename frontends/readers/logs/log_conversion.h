#pragma once

#include <functional>
#include <string>
#include <vector>

#include "frontends/readers/logs/log_writer.h"
#include "frontends/readers/logs/message_source.h"

namespace lodestone {

/// What convert_log() did.
struct Conversion {
  std::int64_t messages = 0;
  std::vector<const TopicInfo*> left_out;  ///< the source's topics that only their own ROS understands
};

/// Copies the topics of a log that the writer's ROS understands, in order of record time: as they are where the log speaks
/// it already; else those of the types that Lodestone knows, field by field. `path` names the log in messages, `progress` is
/// called with each record time; the caller closes the writer. Throws InputError where nothing can be written.
Conversion convert_log(const std::string& path, MessageSource& source, LogWriter& writer,
                       const std::function<void(Time)>& progress);

}  // namespace lodestone
