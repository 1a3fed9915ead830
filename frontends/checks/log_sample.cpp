#include "frontends/checks/log_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontends/lidar/scan_sampling.h"
#include "frontends/readers/logs/known_types.h"
#include "frontends/readers/logs/message_decoder.h"
#include "frontends/readers/logs/open_log.h"
#include "frontends/readers/point_cloud_decoder.h"

namespace lodestone {
namespace {

constexpr double standard_gravity = 9.80665;
constexpr ScanSamplingOptions thinning{0.2, 4000};  // voxel, m; most points
/// Stamps that leap further than this from one message to the next are broken ones: their readings would fill hours.
constexpr Time largest_leap = 100'000'000'000;

std::vector<StreamSample> make_streams(const Platform& platform, const std::vector<TopicInfo>& topics) {
  std::vector<StreamSample> streams;
  streams.push_back({SensorKind::imu, 0, platform.imu.topic, "imu.topic", {}, {}, {}});
  streams.push_back({SensorKind::lidar, 0, platform.lidar.topic, "lidar.topic", {}, {}, {}});
  for (std::size_t j = 0; j < platform.magnetometers.size(); ++j) {
    streams.push_back({SensorKind::magnetometer,
                       j,
                       platform.magnetometers[j].topic,
                       fmt::format("magnetometers[{}].topic", j),
                       {},
                       {},
                       {}});
  }
  for (StreamSample& stream : streams) {
    for (const TopicInfo& topic : topics) {
      if (topic.name == stream.topic && is_message_of(stream.sensor, topic.type) && topic.messages > 0)
        stream.info = topic;
    }
  }
  return streams;
}

bool may_follow(Time stamp, Time last, bool first) {
  return first || (stamp > last && stamp - last < largest_leap);
}

/// Fills a sample message by message.
class Collector {
 public:
  Collector(LogSample& sample, const Platform& platform, std::vector<std::size_t> order)
      : sample_(sample),
        platform_(platform),
        order_(std::move(order)),
        messages_(sample.path),
        clouds_(sample.path, platform, unheard_),
        refused_(sample.streams.size(), false) {}

  void add(const RawMessage& raw) {
    const std::size_t index = order_[raw.topic];
    StreamSample& stream = sample_.streams[index];
    try {
      messages_.decode(*stream.info, raw, message_);
    } catch (const InputError& error) {
      if (!refused_[index]) sample_.refused.push_back(error);
      refused_[index] = true;
      return;
    }
    stream.record_times.push_back(raw.record_time);
    if (const auto* imu = std::get_if<ros1::ImuMessage>(&message_)) {
      stream.stamps.push_back(imu->stamp);
      add(index, *imu);
    } else if (const auto* field = std::get_if<ros1::MagneticFieldMessage>(&message_)) {
      stream.stamps.push_back(field->stamp);
      add(index, *field, stream.magnetometer);
    } else if (const auto* livox = std::get_if<ros1::LivoxMessage>(&message_)) {
      stream.stamps.push_back(livox->stamp);
      add_scan(*livox);
    } else {
      const auto& cloud = std::get<ros1::PointCloudMessage>(message_);
      stream.stamps.push_back(cloud.stamp);
      keep(cloud);
      add_scan(cloud);
    }
  }

 private:
  static Vector3 vector_of(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

  void add(std::size_t index, const ros1::ImuMessage& message) {
    const bool in_g = platform_.imu.acceleration_unit == AccelerationUnit::standard_gravity;
    ImuSample imu{message.stamp, vector_of(message.angular_velocity),
                  vector_of(message.linear_acceleration) * (in_g ? standard_gravity : 1.0)};
    if (!imu.angular_velocity.allFinite() || !imu.linear_acceleration.allFinite()) {
      ++sample_.not_finite[index];
    } else if (may_follow(imu.time, sample_.imu.empty() ? 0 : sample_.imu.back().time, sample_.imu.empty())) {
      sample_.imu.push_back(imu);
    }
  }

  void add(std::size_t index, const ros1::MagneticFieldMessage& message, std::size_t magnetometer) {
    std::vector<MagneticSample>& list = sample_.fields[magnetometer];
    MagneticSample field{message.stamp, static_cast<int>(magnetometer),
                         vector_of(message.field_tesla) * microtesla_per(platform_.magnetometers[magnetometer].unit)};
    if (!field.field_ut.allFinite()) {
      ++sample_.not_finite[index];
    } else if (may_follow(field.time, list.empty() ? 0 : list.back().time, list.empty())) {
      list.push_back(field);
    }
  }

  void keep(const ros1::PointCloudMessage& message) {
    if (sample_.cloud || message.data_size == 0) return;
    sample_.cloud.emplace();
    RawCloud& cloud = *sample_.cloud;
    cloud.message = message;
    cloud.bytes.assign(message.data, message.data + message.data_size);
    cloud.message.data = cloud.bytes.data();
  }

  template <class Message>
  void add_scan(const Message& message) {
    if (sample_.refused_cloud) return;
    LidarScan scan;
    try {
      clouds_.decode(message, scan);
    } catch (const InputError& error) {
      sample_.refused_cloud = error;
      return;
    }
    if (scan.points.empty()) {
      if (sample_.empty_scans++ == 0) sample_.first_empty_scan = scan.start;
      return;
    }
    const bool first = sample_.scans.empty();
    if (!may_follow(scan.end, first ? 0 : sample_.scans.back().end, first)) return;
    scan.points = sample_scan(scan, platform_.suite.lidar, thinning);
    sample_.scans.push_back(std::move(scan));
  }

  LogSample& sample_;
  const Platform& platform_;
  std::vector<std::size_t> order_;  ///< the stream of each selected topic
  MessageDecoder messages_;
  WarningLog unheard_;
  PointCloudDecoder clouds_;
  std::vector<bool> refused_;
  ros1::Message message_;
};

}  // namespace

bool is_message_of(SensorKind sensor, const std::string& type) {
  const MessageType message = message_type(type);
  switch (sensor) {
    case SensorKind::imu:
      return message == MessageType::imu;
    case SensorKind::lidar:
      return message == MessageType::point_cloud || message == MessageType::livox;
    case SensorKind::magnetometer:
      break;
  }
  return message == MessageType::magnetic_field;
}

std::vector<std::string> LogSample::fields_of_cloud() const {
  std::vector<std::string> names;
  if (cloud) {
    for (const ros1::PointField& field : cloud->message.fields) names.push_back(field.name);
  }
  return names;
}

LogSample read_log_sample(const std::string& path, const Platform& platform, double seconds, WarningLog& warnings) {
  const std::unique_ptr<MessageSource> log = open_log(path, warnings);
  LogSample sample;
  sample.path = path;
  sample.topics = log->topics();
  sample.streams = make_streams(platform, sample.topics);
  sample.fields.resize(platform.magnetometers.size());
  sample.not_finite.assign(sample.streams.size(), 0);

  std::vector<std::string> names;
  std::vector<std::size_t> order;
  sample.begin = std::numeric_limits<Time>::max();
  Time log_end = std::numeric_limits<Time>::min();
  for (std::size_t i = 0; i < sample.streams.size(); ++i) {
    const StreamSample& stream = sample.streams[i];
    if (!stream.info || std::find(names.begin(), names.end(), stream.topic) != names.end()) continue;
    names.push_back(stream.topic);
    order.push_back(i);
    sample.begin = std::min(sample.begin, stream.info->begin);
    log_end = std::max(log_end, stream.info->end);
  }
  if (names.empty()) {
    sample.begin = 0;
    return sample;
  }
  sample.log_duration_s = to_seconds(log_end - sample.begin);
  sample.end = std::min(log_end, sample.begin + from_seconds(seconds));
  log->select(names);
  Collector collector(sample, platform, order);
  for (RawMessage raw; log->next(raw) && raw.record_time <= sample.end;) collector.add(raw);
  return sample;
}

}  // namespace lodestone
