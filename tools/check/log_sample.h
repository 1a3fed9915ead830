#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"
#include "frontends/messages/bag_streams.h"
#include "frontends/messages/ros_messages.h"

namespace lodestone {

/// The messages of one sensor in the log. Without info: there is no readable topic of that name.
struct StreamSample : SensorStream {
  std::vector<Time> stamps;        ///< of every message, in order of recording
  std::vector<Time> record_times;  ///< of the same messages
  int not_finite = 0;              ///< messages with non-finite values
  bool refused = false;            ///< the topic's type does not have its paths
};

/// A recorded cloud with its bytes.
struct RawCloud {
  ros1::PointCloudMessage message;  ///< its data points into `bytes`
  std::vector<std::uint8_t> bytes;
};

/// The scans of one LiDAR.
struct LidarSample {
  std::vector<LidarScan> scans;  ///< with strictly increasing ends, thinned to some thousand points
  int empty_scans = 0;
  Time first_empty_scan = 0;
  std::optional<InputError> refused_cloud;  ///< error of the first unreadable cloud
  std::optional<RawCloud> cloud;            ///< the first cloud with points (not of a CustomMsg)
  std::vector<std::string> fields_of_cloud() const;
};

/// The first seconds of a log, read without refusing anything. The input of all checks.
struct LogSample {
  std::string path;
  std::vector<TopicInfo> topics;      ///< all topics of the log
  std::vector<StreamSample> streams;  ///< one per sensor of the platform
  Time begin = 0;                     ///< record time of the first message of the streams
  Time end = 0;                       ///< record time up to which the streams were read
  double log_duration_s = 0.0;        ///< of the whole log, by its record times

  /// Finite, with strictly increasing stamps, in SI units.
  std::vector<ImuSample> imu;
  std::vector<std::vector<MagneticSample>> fields;  ///< one list per magnetometer, uncalibrated
  std::vector<WheelSample> wheels;
  std::vector<LidarSample> lidars;  ///< one per LiDAR; not merged, unlike in a run
  const std::vector<LidarScan>& scans() const { return lidars.front().scans; }

  std::vector<InputError> refused;  ///< paths missing in a topic's type; the first message that cannot be decoded
};

/// Reads the first `seconds` of the chosen sensors. A sensor with a missing topic has an empty stream. Throws
/// InputError if the file is not a log. The file's reader adds its warnings to `warnings`.
LogSample read_log_sample(const std::string& path, const Platform& platform, double seconds, WarningLog& warnings,
                          SensorChoice choice = {});

}  // namespace lodestone
