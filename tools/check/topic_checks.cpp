#include <fmt/format.h>

#include <algorithm>

#include "core/nearest_name.h"
#include "frontends/messages/known_types.h"
#include "tools/check/sensor_checks.h"

namespace lodestone {
namespace {

bool is_named(const LogSample& sample, const std::string& topic) {
  return std::any_of(sample.streams.begin(), sample.streams.end(),
                     [&](const StreamSample& stream) { return stream.topic == topic; });
}

/// Topics of a matching type; first those that the platform does not use.
std::vector<std::string> candidates(const LogSample& sample, Sensor sensor) {
  std::vector<std::string> free;
  std::vector<std::string> taken;
  for (const TopicInfo& topic : sample.topics) {
    if (!is_type_of(sensor, topic.type) || topic.messages == 0) continue;
    (is_named(sample, topic.name) ? taken : free).push_back(topic.name);
  }
  // The topic of another magnetometer cannot be the topic of this one.
  return free.empty() && sensor != Sensor::magnetometer ? taken : free;
}

Finding missing(const LogSample& sample, const StreamSample& stream, const std::string& file) {
  const auto there = std::find_if(sample.topics.begin(), sample.topics.end(),
                                  [&](const TopicInfo& topic) { return topic.name == stream.topic; });
  std::string seen = there == sample.topics.end() ? fmt::format("{}: the log has no such topic", stream.topic)
                     : there->messages == 0
                         ? fmt::format("{}: the topic has no message", stream.topic)
                         : fmt::format("{}: is a {}; expected {}", stream.topic, there->type, types_of(stream));
  const std::vector<std::string> fitting = candidates(sample, stream.sensor);
  std::string change;
  if (!fitting.empty()) {
    change = fmt::format("{}: {} in {}", stream.key, nearest_name(stream.topic, fitting), file);
    if (fitting.size() > 1) change += fmt::format(" (candidates: {})", join_names(fitting));
  } else if (there != sample.topics.end() && there->messages > 0 && stream.sensor != Sensor::lidar) {
    const std::string paths = stream.sensor == Sensor::imu      ? "imu.angular_velocity and imu.linear_acceleration"
                              : stream.sensor == Sensor::wheels ? "wheels.linear_velocity and wheels.angular_velocity"
                                                                : fmt::format("magnetometers[{}].values", stream.index);
    change = fmt::format("{} in {}, or another {}", paths, file, stream.key);
  } else if (stream.sensor == Sensor::wheels) {
    change = fmt::format("remove the section wheels from {}: there are no messages, and no other topic fits", file);
  } else if (stream.sensor == Sensor::magnetometer) {
    change = fmt::format("remove magnetometers[{}] from {}: there are no messages, and no other topic fits",
                         stream.index, file);
  } else {
    seen += fmt::format(", and no topic with a {}", type_of(stream.sensor));
    change = stream.sensor == Sensor::lidar
                 ? "record this sensor; a survey with a trajectory needs no LiDAR for `lodestone map magnetic`"
                 : "record this sensor";
  }
  return {Severity::error, "topic.missing", seen, change};
}

}  // namespace

Findings check_topics(const LogSample& sample, const Platform& platform, SensorChoice needed) {
  Findings findings;
  const std::string file = platform.file_name();
  for (const StreamSample& stream : sample.streams) {
    if (stream.info || stream.refused) continue;
    findings.push_back(missing(sample, stream, file));
    const bool is_needed = stream.sensor == Sensor::lidar          ? needed.lidar
                           : stream.sensor == Sensor::magnetometer ? needed.magnetometers
                           : stream.sensor == Sensor::wheels       ? needed.wheels
                                                                   : needed.imu;
    if (!is_needed) findings.back().severity = Severity::note;
  }
  for (const InputError& error : sample.refused) findings.push_back(error_finding("topic.message", error));
  for (const TopicInfo& topic : sample.topics) {
    if (message_type(topic.type) == MessageType::other || is_named(sample, topic.name) || topic.messages == 0) continue;
    findings.push_back({Severity::note, "topic.unused",
                        fmt::format("{} ({}, {} messages) is in the log, but not in the platform file", topic.name,
                                    topic.type, topic.messages),
                        ""});
  }
  return findings;
}

}  // namespace lodestone
