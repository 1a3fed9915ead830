#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/messages/bag_streams.h"
#include "frontends/messages/message_source.h"
#include "frontends/messages/static_transforms.h"

namespace lodestone {

/// A topic of a LiDAR, an IMU or a magnetometer, and what its first messages show.
struct SurveyedTopic {
  Sensor sensor = Sensor::imu;
  TopicInfo info;                     ///< of the first log that has the topic; `messages` of all logs
  std::size_t log = 0;                ///< index of that log
  std::string frame;                  ///< frame id of the headers
  double period_s = 0.0;              ///< median of the first steps of the stamps; 0 if there is one message only
  std::size_t points = 0;             ///< of the first cloud with points
  LidarMessageLayout layout;          ///< of a LiDAR: settings that its first cloud does not determine are empty
  bool has_times = false;             ///< the reader finds a time of each point; otherwise layout.point_times is none
  std::optional<InputError> refused;  ///< why the reader refuses one of the first messages

  std::int64_t amount() const { return info.messages * static_cast<std::int64_t>(points); }  ///< points in all logs
};

/// The sensors and static transforms of some logs of one robot.
struct LogSurvey {
  std::vector<std::string> logs;
  std::vector<SurveyedTopic> topics;  ///< with messages, in order of name
  std::vector<TopicInfo> others;      ///< all other topics
  StaticTransforms transforms;

  /// Topics with nav_msgs/Odometry, of wheels or of a program: "/odom, /slam"; empty if there are none.
  std::string odometry_topics() const;

  /// All topics as text: "/imu (sensor_msgs/Imu, 6000 messages), …".
  std::string listing() const;
};

/// Reads the first messages of each sensor topic, and all static transforms. Throws InputError if a file is not a log
/// or a transform cannot be decoded.
LogSurvey survey_logs(const std::vector<std::string>& logs, WarningLog& warnings);

/// Why topics of a sensor cannot be read, with their names; "; " between topics. Empty if all can be read.
std::string reasons_of_refusal(const LogSurvey& survey, Sensor sensor);

/// The LiDAR with most points. LiDARs without times of the points follow all others: depth cameras and filters publish
/// such clouds. Null for a robot with magnetometers whose logs have no LiDAR, and no packets of one. Throws InputError
/// that lists the topics if no cloud can be read, or there is neither.
const SurveyedTopic* chosen_lidar(const LogSurvey& survey);

/// The IMU with most messages. Throws InputError that lists the topics if there is none.
const SurveyedTopic& chosen_imu(const LogSurvey& survey);

/// The topics of this sensor but `chosen`: "/a, /b"; empty if there are none.
std::string other_topics(const LogSurvey& survey, const SurveyedTopic& chosen);

}  // namespace lodestone
