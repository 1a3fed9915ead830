#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"
#include "frontends/logs/message_source.h"
#include "frontends/messages/message_paths.h"

namespace lodestone {

enum class Sensor { lidar, imu, magnetometer };

/// One sensor of a log. Several may share a topic: each then has paths of its own in the message.
struct SensorStream {
  Sensor sensor = Sensor::imu;
  std::size_t index = 0;  ///< of the magnetometer, or of the LiDAR: 0 is the first
  std::string topic;
  std::string key;                 ///< where the platform file names the topic: "imu.topic"
  std::vector<std::string> paths;  ///< of the vectors in a message of another type than the sensor's own; mostly none
  std::vector<std::string> path_keys;    ///< where the platform file has them
  std::optional<TopicInfo> info;         ///< of its topic in the log, once that was found
  std::size_t topic_index = 0;           ///< into the list of topics that were chosen
  std::shared_ptr<MessagePaths> reader;  ///< of the paths, one a topic; null where there are none
  std::size_t first_vector = 0;          ///< of its own, in what the reader gives
};

/// "lidar", "imu" or "magnetometer", for kinds of warnings.
const char* part_of(Sensor sensor);

/// The message that ROS has for this kind of sensor.
const char* type_of(Sensor sensor);

/// Whether `type` is a message that such a sensor can be read from without paths.
bool is_type_of(Sensor sensor, const std::string& type);

/// Of which types a stream's topic may be, in words, and which key of the platform file reads others.
std::string types_of(const SensorStream& stream);

/// The streams of the chosen sensors: IMU, LiDARs, magnetometers.
std::vector<SensorStream> make_streams(const Platform& platform, SensorChoice choice);

/// Gives a stream with paths, whose topic was found, its reader: the one that another of `streams` has of that topic,
/// or a new one. Throws InputError as MessagePaths does.
void bind_paths(const std::string& path, const std::vector<SensorStream>& streams, SensorStream& stream);

/// Finds each stream's topic among `topics`, fills info, topic_index and reader, and gives the names of the topics to
/// choose. Throws InputError, with the topics that are there and the key to change, where one is absent or of another
/// type.
std::vector<std::string> find_topics(const std::string& path, const Platform& platform,
                                     const std::vector<TopicInfo>& topics, std::vector<SensorStream>& streams);

}  // namespace lodestone
