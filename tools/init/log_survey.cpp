#include "tools/init/log_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <variant>

#include "core/evaluation/statistics.h"
#include "core/nearest_name.h"
#include "frontends/logs/open_log.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_decoder.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tools/progress.h"

namespace lodestone {
namespace {

constexpr int surveyed_scans = 20;
constexpr int surveyed_samples = 400;
constexpr double usual_scan_period_s = 0.1;

std::optional<Sensor> sensor_of(const TopicInfo& topic) {
  if (topic.encoding == Encoding::other) return std::nullopt;
  for (const Sensor sensor : {Sensor::lidar, Sensor::imu, Sensor::magnetometer}) {
    if (is_type_of(sensor, topic.type)) return sensor;
  }
  return std::nullopt;
}

std::size_t points_of(const ros1::Message& message) {
  if (const auto* livox = std::get_if<ros1::LivoxMessage>(&message)) return livox->point_count;
  const auto* cloud = std::get_if<ros1::PointCloudMessage>(&message);
  return cloud == nullptr ? 0 : std::size_t{cloud->width} * cloud->height;
}

double median_step_s(const std::vector<Time>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] > times[i - 1]) steps.push_back(to_seconds(times[i] - times[i - 1]));
  }
  return summarize(steps).median;
}

LidarMessageLayout undetermined_layout(const std::string& name) {
  LidarMessageLayout layout;
  layout.topic = name;
  layout.stamp.reset();
  layout.intensity_field.clear();
  layout.ring_field.clear();
  layout.time_field.clear();
  layout.time_unit.reset();
  return layout;
}

/// The layout that the reader determines from the first cloud of a topic.
class LayoutProbe {
 public:
  LayoutProbe(const std::string& path, SurveyedTopic& topic) : path_(path), topic_(topic) {}

  void run(const ros1::PointCloudMessage& cloud) {
    if (try_with(PointTimes::field, cloud)) {
      topic_.has_times = true;
      topic_.refused.reset();
      return;
    }
    const std::optional<InputError> without_times = topic_.refused;
    topic_.refused.reset();
    if (!try_with(PointTimes::none, cloud)) topic_.refused = without_times;
  }

 private:
  bool try_with(PointTimes point_times, const ros1::PointCloudMessage& cloud) {
    Platform platform;
    platform.lidar = undetermined_layout(topic_.info.name);
    platform.lidar.point_times = point_times;
    if (topic_.period_s > 0.0) platform.suite.lidar.scan_period_s = topic_.period_s;
    try {
      PointCloudDecoder decoder(path_, platform, unheard_);
      decoder.decode(cloud, scan_);
      topic_.layout = decoder.determined_layout().value_or(platform.lidar);
      return true;
    } catch (const InputError& error) {
      topic_.refused = error;
      return false;
    }
  }

  const std::string& path_;
  SurveyedTopic& topic_;
  LidarScan scan_;
  WarningLog unheard_;
};

/// Reads the first messages of a topic. Throws InputError if one cannot be decoded.
void read_first_messages(const std::string& path, MessageSource& log, SurveyedTopic& topic) {
  log.select({topic.info.name});
  MessageDecoder decoder(path);
  ros1::Message message;
  std::vector<Time> stamps, record_times;
  std::optional<ros1::PointCloudMessage> cloud;
  std::vector<std::uint8_t> bytes;
  const int wanted = topic.sensor == Sensor::lidar ? surveyed_scans : surveyed_samples;
  RawMessage raw;
  for (int i = 0; i < wanted && log.next(raw); ++i) {
    decoder.decode(topic.info, raw, message);
    record_times.push_back(raw.record_time);
    std::visit(
        [&](const auto& each) {
          stamps.push_back(each.stamp);
          topic.frame = each.frame;
        },
        message);
    if (topic.points > 0) continue;
    topic.points = points_of(message);
    const auto* read = std::get_if<ros1::PointCloudMessage>(&message);
    if (topic.points == 0 || read == nullptr) continue;
    cloud = *read;
    bytes.assign(read->data, read->data + read->data_size);
    cloud->data = bytes.data();
  }
  topic.period_s = median_step_s(stamps);
  if (topic.period_s == 0.0) topic.period_s = median_step_s(record_times);
  if (topic.sensor != Sensor::lidar) return;
  topic.layout = undetermined_layout(topic.info.name);
  if (topic.period_s == 0.0) topic.period_s = usual_scan_period_s;
  topic.has_times = message_type(topic.info.type) == MessageType::livox;
  if (cloud) LayoutProbe(path, topic).run(*cloud);
}

std::string topic_text(const TopicInfo& topic) {
  return fmt::format("{} ({}, {} messages)", topic.name, topic.type.empty() ? "without a type" : topic.type,
                     topic.messages);
}

/// The error if no topic of a sensor can be used. `change`: the remedy.
InputError no_topic(const LogSurvey& survey, const std::string& expected, const std::string& change) {
  return InputError(fmt::format("{}: there is no topic of {}; {}; the log has {}", join_names(survey.logs), expected,
                                change, survey.listing()));
}

}  // namespace

std::string LogSurvey::listing() const {
  std::vector<std::string> names;
  for (const SurveyedTopic& topic : topics) names.push_back(topic_text(topic.info));
  for (const TopicInfo& topic : others) names.push_back(topic_text(topic));
  return names.empty() ? "no topics" : join_names(names);
}

std::string LogSurvey::odometry_topics() const {
  std::vector<std::string> names;
  for (const TopicInfo& topic : others) {
    if (message_type(topic.type) == MessageType::odometry && topic.messages > 0) names.push_back(topic.name);
  }
  return join_names(names);
}

LogSurvey survey_logs(const std::vector<std::string>& logs, WarningLog& warnings) {
  LogSurvey survey;
  survey.logs = logs;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const std::unique_ptr<MessageSource> log = open_log(logs[i], warnings);
    for (const TopicInfo& info : log->topics()) {
      const std::optional<Sensor> sensor = sensor_of(info);
      if (!sensor || info.messages == 0) {
        survey.others.push_back(info);
        continue;
      }
      throw_if_interrupted();
      const auto known = std::find_if(survey.topics.begin(), survey.topics.end(), [&info](const SurveyedTopic& each) {
        return each.info.name == info.name && each.info.type == info.type;
      });
      if (known != survey.topics.end()) {
        known->info.messages += info.messages;
        continue;
      }
      SurveyedTopic& topic = survey.topics.emplace_back();
      topic.sensor = *sensor;
      topic.info = info;
      topic.log = i;
      try {
        read_first_messages(logs[i], *log, topic);
      } catch (const InputError& error) {
        topic.refused = error;
      }
    }
    read_static_transforms(logs[i], *log, survey.transforms);
  }
  std::stable_sort(survey.topics.begin(), survey.topics.end(),
                   [](const SurveyedTopic& a, const SurveyedTopic& b) { return a.info.name < b.info.name; });
  return survey;
}

std::string reasons_of_refusal(const LogSurvey& survey, Sensor sensor) {
  std::string reasons;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.sensor != sensor || !topic.refused) continue;
    reasons += fmt::format("{}{}", reasons.empty() ? "" : "; ", topic.refused->what());
  }
  return reasons;
}

const SurveyedTopic* chosen_lidar(const LogSurvey& survey) {
  const SurveyedTopic* best = nullptr;
  std::string reasons;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.sensor != Sensor::lidar) continue;
    if (topic.points == 0 || topic.refused) {
      reasons += fmt::format("{}{}", reasons.empty() ? "" : "; ",
                             topic.refused ? topic.refused->what() : topic.info.name + ": the first clouds are empty");
      continue;
    }
    const auto rank = [](const SurveyedTopic& each) { return std::pair(each.has_times, each.amount()); };
    if (best == nullptr || rank(topic) > rank(*best)) best = &topic;
  }
  const bool has_packets = std::ranges::any_of(survey.others, [](const TopicInfo& topic) {
    return topic.type.ends_with("Packet") || topic.type.ends_with("PacketMsg") || topic.type.ends_with("Packets") ||
           (topic.type.ends_with("Scan") && !topic.type.ends_with("/LaserScan"));
  });
  const bool localizes_without = !has_packets && std::ranges::any_of(survey.topics, [](const SurveyedTopic& topic) {
    return topic.sensor == Sensor::magnetometer && !topic.refused;
  });
  if (best != nullptr || (reasons.empty() && localizes_without)) return best;
  if (reasons.empty()) {
    reasons = "record the LiDAR's points, not its packets, or add a log that has them";
    const std::string unread = reasons_of_refusal(survey, Sensor::magnetometer);
    if (!unread.empty()) reasons += "; " + unread;
  }
  throw no_topic(survey, "a LiDAR that can be read (sensor_msgs/PointCloud2 or livox_ros_driver2/CustomMsg)", reasons);
}

const SurveyedTopic& chosen_imu(const LogSurvey& survey) {
  const SurveyedTopic* best = nullptr;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.sensor != Sensor::imu || topic.refused) continue;
    if (best == nullptr || topic.info.messages > best->info.messages) best = &topic;
  }
  if (best != nullptr) return *best;
  const std::string reasons = reasons_of_refusal(survey, Sensor::imu);
  throw no_topic(survey, "an IMU that can be read (sensor_msgs/Imu)",
                 reasons.empty() ? "record the IMU, or write the platform file by hand with imu.angular_velocity and "
                                   "imu.linear_acceleration as paths in a message of another type"
                                 : reasons);
}

std::string other_topics(const LogSurvey& survey, const SurveyedTopic& chosen) {
  std::vector<std::string> names;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.sensor == chosen.sensor && topic.info.name != chosen.info.name) names.push_back(topic.info.name);
  }
  return join_names(names);
}

}  // namespace lodestone
