#pragma once

#include <cstdint>
#include <functional>

#include "frontends/logs/log_writer.h"
#include "tools/export/deskewed_scans.h"
#include "tools/export/run_results.h"

namespace lodestone {

/// Frames and topics of an exported run.
struct ExportedEstimator {
  std::string frame;   ///< of the IMU: imu for the first estimator, NAME/imu for the others
  std::string prefix;  ///< of the topics: /lodestone/NAME
};

/// `index`: of the estimator in the run. Characters that ROS does not allow in names become underscores.
ExportedEstimator exported_names(const RunResults& run, std::size_t index);

/// Writes the results as ROS 2 messages in order of time (docs/user/export.md lists the topics). `scans` may be null.
/// `progress` gets the time of each message. Returns the number of messages.
std::int64_t export_log(const RunResults& run, DeskewedScans* scans, LogWriter& writer,
                        const std::function<void(Time)>& progress);

}  // namespace lodestone
