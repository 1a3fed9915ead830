#include "tools/check/log_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lidar/scan_sampling.h"
#include "frontends/configuration/platform_lidars.h"
#include "frontends/logs/open_log.h"
#include "frontends/messages/stream_decoder.h"

namespace lodestone {
namespace {

constexpr ScanSamplingOptions thinning{0.2, 4000};  // voxel side, m; largest number of points
/// A larger step between two stamps is a broken stamp. Its readings would fill hours.
constexpr Time largest_leap = 100'000'000'000;

/// The platform's sensors, each with a matching topic of the log if there is one. Sensors that cannot be bound go to
/// `refused`.
std::vector<StreamSample> find_streams(const std::string& path, const Platform& platform, SensorChoice choice,
                                       const std::vector<TopicInfo>& topics, std::vector<InputError>& refused) {
  std::vector<SensorStream> streams = make_streams(platform, choice);
  std::vector<StreamSample> found;
  for (SensorStream& stream : streams) {
    bool is_refused = false;
    for (const TopicInfo& topic : topics) {
      const bool fits = !stream.paths.empty() || is_type_of(stream.sensor, topic.type);
      if (topic.name == stream.topic && fits && topic.messages > 0) stream.info = topic;
    }
    try {
      if (stream.info) bind_paths(path, streams, stream);
    } catch (const InputError& error) {
      refused.push_back(error);
      stream.info.reset();
      is_refused = true;
    }
    found.push_back({stream, {}, {}, 0, is_refused});
  }
  return found;
}

template <class Sample>
bool may_follow(Time stamp, const std::vector<Sample>& list, Time Sample::*time) {
  return list.empty() || (stamp > list.back().*time && stamp - list.back().*time < largest_leap);
}

/// Builds a sample message by message.
class Collector {
 public:
  Collector(LogSample& sample, const Platform& platform, std::size_t topics)
      : sample_(sample), platform_(platform), decoder_(sample.path, platform, unheard_), refused_(topics, false) {}

  void add(const RawMessage& raw) {
    decoder_.set(raw);
    for (StreamSample& stream : sample_.streams) {
      if (!stream.info || stream.topic_index != raw.topic) continue;
      Time stamp = 0;
      try {
        stamp = decoder_.stamp(stream);
      } catch (const InputError& error) {
        if (!refused_[raw.topic]) sample_.refused.push_back(error);
        refused_[raw.topic] = true;
        continue;
      }
      stream.record_times.push_back(raw.record_time);
      stream.stamps.push_back(stamp);
      if (stream.sensor == Sensor::imu) add_imu(stream);
      if (stream.sensor == Sensor::magnetometer) add_field(stream);
      if (stream.sensor == Sensor::wheels) add_wheels(stream);
      if (stream.sensor == Sensor::lidar) add_scan(stream);
    }
  }

 private:
  void add_imu(StreamSample& stream) {
    const ImuSample imu = decoder_.imu(stream);
    if (!imu.angular_velocity.allFinite() || !imu.linear_acceleration.allFinite()) {
      ++stream.not_finite;
    } else if (may_follow(imu.time, sample_.imu, &ImuSample::time)) {
      sample_.imu.push_back(imu);
    }
  }

  void add_field(StreamSample& stream) {
    std::vector<MagneticSample>& list = sample_.fields[stream.index];
    const MagneticSample field = decoder_.field(stream);
    if (!field.field_ut.allFinite()) {
      ++stream.not_finite;
    } else if (may_follow(field.time, list, &MagneticSample::time)) {
      list.push_back(field);
    }
  }

  void add_wheels(StreamSample& stream) {
    const std::optional<WheelSample> wheels = decoder_.wheels(stream);
    if (!wheels) return;
    const bool finite = std::isfinite(wheels->forward_velocity_m_s) && std::isfinite(wheels->lateral_velocity_m_s) &&
                        std::isfinite(wheels->yaw_rate_rad_s);
    if (!finite) {
      ++stream.not_finite;
    } else if (may_follow(wheels->time, sample_.wheels, &WheelSample::time)) {
      sample_.wheels.push_back(*wheels);
    }
  }

  void add_scan(const StreamSample& stream) {
    LidarSample& lidar = sample_.lidars[stream.index];
    keep(stream, lidar);
    if (lidar.refused_cloud) return;
    LidarScan scan;
    try {
      decoder_.scan(stream, scan);
    } catch (const InputError& error) {
      lidar.refused_cloud = error;
      return;
    }
    if (scan.points.empty()) {
      if (lidar.empty_scans++ == 0) lidar.first_empty_scan = scan.start;
      return;
    }
    if (!may_follow(scan.end, lidar.scans, &LidarScan::end)) return;
    scan.points = sample_scan(scan, model_of(platform_, stream.index), thinning);
    lidar.scans.push_back(std::move(scan));
  }

  void keep(const StreamSample& stream, LidarSample& lidar) {
    const ros1::PointCloudMessage* message = lidar.cloud ? nullptr : decoder_.cloud(stream);
    if (message == nullptr || message->data_size == 0) return;
    RawCloud& cloud = lidar.cloud.emplace();
    cloud.message = *message;
    cloud.bytes.assign(message->data, message->data + message->data_size);
    cloud.message.data = cloud.bytes.data();
  }

  LogSample& sample_;
  const Platform& platform_;
  WarningLog unheard_;
  StreamDecoder decoder_;
  std::vector<bool> refused_;  ///< whether a message of the topic was refused
};

}  // namespace

std::vector<std::string> LidarSample::fields_of_cloud() const {
  std::vector<std::string> names;
  if (cloud) {
    for (const ros1::PointField& field : cloud->message.fields) names.push_back(field.name);
  }
  return names;
}

LogSample read_log_sample(const std::string& path, const Platform& platform, double seconds, WarningLog& warnings,
                          SensorChoice choice) {
  const std::unique_ptr<MessageSource> log = open_log(path, warnings);
  LogSample sample;
  sample.path = path;
  sample.topics = log->topics();
  sample.streams = find_streams(path, platform, choice, sample.topics, sample.refused);
  sample.fields.resize(platform.magnetometers.size());
  sample.lidars.resize(lidar_count(platform));

  std::vector<std::string> names;
  sample.begin = std::numeric_limits<Time>::max();
  Time log_end = std::numeric_limits<Time>::min();
  for (StreamSample& stream : sample.streams) {
    if (!stream.info) continue;
    const auto place = std::find(names.begin(), names.end(), stream.topic);
    stream.topic_index = static_cast<std::size_t>(place - names.begin());
    if (place == names.end()) names.push_back(stream.topic);
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
  Collector collector(sample, platform, names.size());
  for (RawMessage raw; log->next(raw) && raw.record_time <= sample.end;) collector.add(raw);
  return sample;
}

}  // namespace lodestone
