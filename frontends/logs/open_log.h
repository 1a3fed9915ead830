#pragma once

#include <memory>
#include <string>

#include "core/warnings.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// Opens a log. Its kind is told by its content, never by its name:
/// - a ROS 1 bag, closed by its recorder or not;
/// - a ROS 2 bag: an MCAP or SQLite file, also packed as a whole by zstd; a folder of them with its metadata.yaml, or
/// that
///   file; a folder of logs without it;
/// - a folder of CSV and PCD files (csv_log.h).
///
/// Throws InputError where there is no such log, or it is of no known kind. What is lost of a damaged or cut-off log is
/// counted in `warnings` (log.*), which must outlive the source.
std::unique_ptr<MessageSource> open_log(const std::string& path, WarningLog& warnings);

}  // namespace lodestone
