#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontends/readers/logs/message_paths.h"
#include "frontends/readers/logs/message_source.h"
#include "frontends/readers/platform.h"
#include "frontends/readers/sensor_choice.h"

namespace lodestone {

enum class Sensor { lidar, imu, magnetometer };

/// One sensor of a log. Several may share a topic: each then has paths of its own in the message.
struct SensorStream {
  Sensor sensor = Sensor::imu;
  std::size_t index = 0;  ///< of the magnetometer, or of the LiDAR: 0 is the first
  std::string topic;
  std::string key;        ///< where the platform file names the topic: "imu.topic"
  std::vector<std::string> paths;      ///< of the vectors in a message of another type than the sensor's own; mostly none
  std::vector<std::string> path_keys;  ///< where the platform file has them
  std::size_t topic_index = 0;         ///< into the list of topics that were chosen
  std::shared_ptr<const MessagePaths> reader;  ///< of the paths; null where there are none
  Time last_stamp = 0;
  Time recorder_lag = 0;  ///< record time less stamp, of the first message
  bool any = false;
};

/// "lidar", "imu" or "magnetometer", for kinds of warnings.
const char* part_of(Sensor sensor);

/// The streams of the chosen sensors: IMU, LiDARs, magnetometers.
std::vector<SensorStream> make_streams(const Platform& platform, SensorChoice choice);

/// Finds each stream's topic among `topics`, fills topic_index and reader, and gives the names of the topics to choose.
/// Throws InputError, with the topics that are there and the key to change, where one is absent or of another type.
std::vector<std::string> find_topics(const std::string& path, const Platform& platform,
                                     const std::vector<TopicInfo>& topics, std::vector<SensorStream>& streams);

}  // namespace lodestone
