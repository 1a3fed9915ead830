#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"
#include "frontends/messages/message_paths.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

enum class Sensor { lidar, imu, magnetometer, wheels };

/// One sensor of a log. Several sensors may share a topic; each then has its own paths in the message.
struct SensorStream {
  Sensor sensor = Sensor::imu;
  std::size_t index = 0;  ///< of the magnetometer, or of the LiDAR: 0 is the first
  std::string topic;
  std::string key;                       ///< key of the topic in the platform file: "imu.topic"
  std::vector<std::string> paths;        ///< paths of the vectors in messages of other types; mostly empty
  std::vector<std::string> path_keys;    ///< keys of these paths in the platform file
  bool numbers = false;                  ///< the paths name single numbers, not vectors
  std::optional<TopicInfo> info;         ///< of its topic in the log, if found
  std::size_t topic_index = 0;           ///< index in the list of chosen topics
  std::shared_ptr<MessagePaths> reader;  ///< reader of the paths, one per topic; null without paths
  std::size_t first_vector = 0;          ///< index of the sensor's first vector in the reader's output
};

/// "lidar", "imu", "magnetometer" or "wheels", for kinds of warnings.
const char* part_of(Sensor sensor);

/// The ROS message type of this kind of sensor.
const char* type_of(Sensor sensor);

/// True if such a sensor can be read from messages of `type` without paths.
bool is_type_of(Sensor sensor, const std::string& type);

/// Supported types of a stream's topic as text, with the platform key for other types.
std::string types_of(const SensorStream& stream);

/// The streams of the chosen sensors: IMU, LiDARs, magnetometers, wheels.
std::vector<SensorStream> make_streams(const Platform& platform, SensorChoice choice);

/// Sets the reader of a stream with paths whose topic was found: the reader of another of `streams` with the same
/// topic, or a new one. Throws InputError as MessagePaths does.
void bind_paths(const std::string& path, const std::vector<SensorStream>& streams, SensorStream& stream);

/// Finds each stream's topic among `topics`, sets info, topic_index and reader, and returns the names of the topics.
/// Throws InputError with the available topics and the key to change if a topic is absent or of another type.
std::vector<std::string> find_topics(const std::string& path, const Platform& platform,
                                     const std::vector<TopicInfo>& topics, std::vector<SensorStream>& streams);

}  // namespace lodestone
