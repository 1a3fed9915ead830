#include "frontends/messages/bag_streams.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/messages/known_types.h"

namespace lodestone {

const char* type_of(Sensor sensor) {
  switch (sensor) {
    case Sensor::lidar:
      return "sensor_msgs/PointCloud2";
    case Sensor::imu:
      return "sensor_msgs/Imu";
    case Sensor::wheels:
      return "nav_msgs/Odometry";
    case Sensor::magnetometer:
      break;
  }
  return "sensor_msgs/MagneticField";
}

bool is_type_of(Sensor sensor, const std::string& type) {
  return type == type_of(sensor) || (sensor == Sensor::lidar && message_type(type) == MessageType::livox);
}

std::string types_of(const SensorStream& stream) {
  const std::string own = type_of(stream.sensor);
  switch (stream.sensor) {
    case Sensor::lidar:
      return own + " or livox_ros_driver2/CustomMsg";
    case Sensor::imu:
      return own +
             ", or set imu.angular_velocity and imu.linear_acceleration to their paths in a message of another type";
    case Sensor::wheels:
      return own +
             ", or set wheels.linear_velocity and wheels.angular_velocity, or wheels.left_position and "
             "wheels.right_position, to their paths in a message of another type";
    case Sensor::magnetometer:
      break;
  }
  return fmt::format("{}, or set magnetometers[{}].values to the path in a message of another type", own, stream.index);
}

const char* part_of(Sensor sensor) {
  switch (sensor) {
    case Sensor::lidar:
      return "lidar";
    case Sensor::imu:
      return "imu";
    case Sensor::wheels:
      return "wheels";
    case Sensor::magnetometer:
      break;
  }
  return "magnetometer";
}

std::vector<SensorStream> make_streams(const Platform& platform, SensorChoice choice) {
  std::vector<SensorStream> streams;
  const auto add = [&streams](Sensor sensor, std::size_t index, const std::string& topic,
                              std::string key) -> SensorStream& {
    SensorStream& stream = streams.emplace_back();
    stream.sensor = sensor;
    stream.index = index;
    stream.topic = topic;
    stream.key = std::move(key);
    return stream;
  };
  if (choice.imu) {
    SensorStream& imu = add(Sensor::imu, 0, platform.imu.topic, "imu.topic");
    if (!platform.imu.angular_velocity_path.empty()) {
      imu.paths = {platform.imu.angular_velocity_path, platform.imu.linear_acceleration_path};
      imu.path_keys = {"imu.angular_velocity", "imu.linear_acceleration"};
    }
  }
  if (choice.lidar && platform.has_lidar()) {
    add(Sensor::lidar, 0, platform.lidar.topic, "lidar.topic");
    for (std::size_t i = 0; i < platform.further_lidars.size(); ++i) {
      add(Sensor::lidar, i + 1, platform.further_lidars[i].topic, fmt::format("further_lidars[{}].topic", i));
    }
  }
  for (std::size_t i = 0; choice.magnetometers && i < platform.magnetometers.size(); ++i) {
    const MagnetometerMessageLayout& layout = platform.magnetometers[i];
    SensorStream& stream = add(Sensor::magnetometer, i, layout.topic, fmt::format("magnetometers[{}].topic", i));
    if (layout.path.empty()) continue;
    stream.paths = {layout.path};
    stream.path_keys = {fmt::format("magnetometers[{}].values", i)};
  }
  if (choice.wheels && platform.suite.wheels) {
    SensorStream& wheels = add(Sensor::wheels, 0, platform.wheels.topic, "wheels.topic");
    if (!platform.wheels.linear_velocity_path.empty()) {
      wheels.paths = {platform.wheels.linear_velocity_path, platform.wheels.angular_velocity_path};
      wheels.path_keys = {"wheels.linear_velocity", "wheels.angular_velocity"};
    }
    if (!platform.wheels.left_path.empty()) {
      for (const bool left : {true, false}) {
        const std::string& path = left ? platform.wheels.left_path : platform.wheels.right_path;
        wheels.paths.push_back(path.substr(path.starts_with('-') ? 1 : 0));
        wheels.path_keys.push_back(
            fmt::format("wheels.{}_{}", left ? "left" : "right", platform.wheels.positions ? "position" : "velocity"));
      }
      wheels.numbers = true;
    }
  }
  return streams;
}

void bind_paths(const std::string& path, const std::vector<SensorStream>& streams, SensorStream& stream) {
  if (stream.paths.empty()) return;
  const auto other = std::find_if(streams.begin(), streams.end(), [&stream](const SensorStream& each) {
    return each.reader != nullptr && each.topic == stream.topic;
  });
  const auto reader = other == streams.end() ? std::make_shared<MessagePaths>(path, *stream.info) : other->reader;
  for (std::size_t i = 0; i < stream.paths.size(); ++i) {
    const std::string& key = stream.path_keys[i];
    const std::size_t place =
        stream.numbers ? reader->add_number(stream.paths[i], key) : reader->add(stream.paths[i], key);
    if (i == 0) stream.first_vector = place;
  }
  stream.reader = reader;
}

std::vector<std::string> find_topics(const std::string& path, const Platform& platform,
                                     const std::vector<TopicInfo>& topics, std::vector<SensorStream>& streams) {
  if (streams.empty())
    throw InputError(platform.file_name() +
                     ": there is no topic of the required sensors; add the topics (magnetometers: - topic: ...)");
  if (topics.empty()) throw InputError(path + ": the log has no messages");
  const std::string list =
      join_names(topics, [](const TopicInfo& topic) { return fmt::format("{} ({})", topic.name, topic.type); });
  std::vector<std::string> chosen;
  for (SensorStream& stream : streams) {
    const std::string key = stream.key + " in " + platform.file_name();
    const auto found = std::find_if(topics.begin(), topics.end(),
                                    [&stream](const TopicInfo& topic) { return topic.name == stream.topic; });
    if (found == topics.end()) {
      std::vector<std::string> of_type;
      for (const auto& topic : topics) {
        if (is_type_of(stream.sensor, topic.type)) of_type.push_back(topic.name);
      }
      const std::string hint = of_type.empty() ? fmt::format("the log has no {}", type_of(stream.sensor))
                                               : "did you mean " + nearest_name(stream.topic, of_type) + "?";
      const char* silent = stream.sensor == Sensor::magnetometer ? ", or remove that magnetometer if it was silent"
                           : stream.sensor == Sensor::wheels     ? ", or remove the section wheels"
                                                                 : "";
      throw InputError(fmt::format("{}: there is no topic {}; {}; set {}{}; the log has {}", path, stream.topic, hint,
                                   key, silent, list));
    }
    stream.info = *found;
    if (stream.paths.empty() && !is_type_of(stream.sensor, found->type)) {
      throw InputError(fmt::format("{}: topic {} is a {}; expected a {}; set {}; the log has {}", path, stream.topic,
                                   found->type, types_of(stream), key, list));
    }
    if (found->messages == 0) {
      const char* out = stream.sensor == Sensor::magnetometer ? ", or remove that magnetometer"
                        : stream.sensor == Sensor::wheels     ? ", or remove the section wheels"
                                                              : "";
      throw InputError(
          fmt::format("{}: topic {} has no messages; set {} to a topic with messages{}; "
                      "the log has {}",
                      path, stream.topic, key, out, list));
    }
    bind_paths(path, streams, stream);
    const auto place = std::find(chosen.begin(), chosen.end(), stream.topic);
    stream.topic_index = static_cast<std::size_t>(place - chosen.begin());
    if (place == chosen.end()) chosen.push_back(stream.topic);
  }
  return chosen;
}

}  // namespace lodestone
