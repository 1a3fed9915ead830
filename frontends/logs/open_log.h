#pragma once

#include <memory>
#include <string>

#include "core/warnings.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Opens a log. The content determines its format, never its name:
/// - a ROS 1 bag, even if its recorder did not close it;
/// - a ROS 2 bag: an MCAP or SQLite file, optionally packed as a whole with zstd; a folder of such files with or
///   without metadata.yaml; or that metadata.yaml;
/// - a folder of CSV and PCD files (csv_log.h).
///
/// Throws InputError if there is no such log, or its format is unknown. Losses of a damaged or cut-off log are counted
/// in `warnings` (log.*), which must outlive the source.
std::unique_ptr<MessageSource> open_log(const std::string& path, WarningLog& warnings);

}  // namespace lodestone
