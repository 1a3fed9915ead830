#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/readers/logs/message_source.h"
#include "frontends/readers/platform.h"
#include "frontends/readers/ros1/messages.h"

namespace lodestone {

enum class SensorKind { imu, lidar, magnetometer };

/// What a log holds of one sensor of the platform.
struct StreamSample {
  SensorKind sensor = SensorKind::imu;
  std::size_t magnetometer = 0;    ///< index, of a magnetometer
  std::string topic;               ///< as the platform names it
  std::string key;                 ///< where the platform file names it
  std::optional<TopicInfo> info;   ///< nothing: no topic of that name and a fitting type
  std::vector<Time> stamps;        ///< of every message, in order of recording
  std::vector<Time> record_times;  ///< of the same messages
};

/// A cloud as it was recorded, with its bytes.
struct RawCloud {
  ros1::PointCloudMessage message;  ///< its data points into `bytes`
  std::vector<std::uint8_t> bytes;
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
  std::vector<std::vector<MagneticSample>> fields;  ///< one list a magnetometer
  std::vector<LidarScan> scans;                     ///< thinned to some thousand points
  int empty_scans = 0;
  Time first_empty_scan = 0;
  std::vector<int> not_finite;  ///< messages with values that are no numbers, one count a stream

  std::optional<InputError> refused_cloud;  ///< why the first cloud that cannot be read cannot
  std::optional<RawCloud> cloud;            ///< the first cloud with points (none of a CustomMsg)
  std::vector<std::string> fields_of_cloud() const;
  std::vector<InputError> refused;  ///< the first message of a topic that cannot be decoded at all
};

/// Reads `seconds` from the log's begin. A sensor whose topic is missing has an empty stream. Throws InputError where
/// the file is no log. `warnings` gets what the reader of the file has to say.
LogSample read_log_sample(const std::string& path, const Platform& platform, double seconds, WarningLog& warnings);

/// What the platform calls this type of sensor's messages.
bool is_message_of(SensorKind sensor, const std::string& type);

}  // namespace lodestone
