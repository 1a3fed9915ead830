#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"
#include "frontends/logs/ros1/messages.h"
#include "frontends/messages/bag_streams.h"

namespace lodestone {

/// What a log holds of one sensor of the platform. Without info: no topic of that name that
/// can be read.
struct StreamSample : SensorStream {
  std::vector<Time> stamps;        ///< of every message, in order of recording
  std::vector<Time> record_times;  ///< of the same messages
  int not_finite = 0;              ///< messages with values that are no numbers
  bool refused = false;            ///< its paths are none of the topic's type
};

/// A cloud as it was recorded, with its bytes.
struct RawCloud {
  ros1::PointCloudMessage message;  ///< its data points into `bytes`
  std::vector<std::uint8_t> bytes;
};

/// What one LiDAR saw.
struct LidarSample {
  std::vector<LidarScan> scans;  ///< with strictly increasing ends, thinned to some thousand points
  int empty_scans = 0;
  Time first_empty_scan = 0;
  std::optional<InputError> refused_cloud;  ///< why the first cloud that cannot be read cannot
  std::optional<RawCloud> cloud;            ///< the first cloud with points (none of a CustomMsg)
  std::vector<std::string> fields_of_cloud() const;
};

/// The begin of a log as it is, read without refusing anything: what checks look at.
struct LogSample {
  std::string path;
  std::vector<TopicInfo> topics;      ///< everything in the log
  std::vector<StreamSample> streams;  ///< one a sensor of the platform
  Time begin = 0;                     ///< record time of the first message of the streams
  Time end = 0;                       ///< record time up to which the streams were read
  double log_duration_s = 0.0;        ///< of the whole log, by its record times

  /// Finite, with strictly increasing stamps, in the units that the platform makes of them.
  std::vector<ImuSample> imu;
  std::vector<std::vector<MagneticSample>> fields;  ///< one list a magnetometer, without its calibration
  std::vector<LidarSample> lidars;                  ///< one a LiDAR: they are not merged, as a run merges them
  const std::vector<LidarScan>& scans() const { return lidars.front().scans; }

  std::vector<InputError>
      refused;  ///< paths that a topic's type has not; the first message that cannot be decoded at all
};

/// Reads `seconds` of the chosen sensors from the log's begin. A sensor whose topic is missing has an empty stream.
/// Throws InputError where the file is no log. `warnings` gets what the reader of the file has to say.
LogSample read_log_sample(const std::string& path, const Platform& platform, double seconds, WarningLog& warnings,
                          SensorChoice choice = {});

}  // namespace lodestone
