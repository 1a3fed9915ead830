#include "frontends/readers/bag_source.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "frontends/configuration/nearest_name.h"
#include "frontends/readers/logs/known_types.h"
#include "frontends/readers/logs/message_decoder.h"
#include "frontends/readers/logs/open_log.h"
#include "frontends/readers/point_cloud_decoder.h"
#include "frontends/readers/sensor_checks.h"

namespace lodestone {
namespace {

enum class Sensor { lidar, imu, magnetometer };

/// One topic that is read.
struct Stream {
  Sensor sensor;
  std::size_t magnetometer;  ///< index, for Sensor::magnetometer
  std::string topic;
  std::string key;  ///< where the platform file names the topic
  Time last_stamp = 0;
  Time recorder_lag = 0;  ///< record time less stamp, of the first message
  bool any = false;
};

const char* type_of(Sensor sensor) {
  switch (sensor) {
    case Sensor::lidar:
      return "sensor_msgs/PointCloud2";
    case Sensor::imu:
      return "sensor_msgs/Imu";
    case Sensor::magnetometer:
      break;
  }
  return "sensor_msgs/MagneticField";
}

bool is_type_of(Sensor sensor, const std::string& type) {
  return type == type_of(sensor) || (sensor == Sensor::lidar && message_type(type) == MessageType::livox);
}

const char* part_of(Sensor sensor) {
  switch (sensor) {
    case Sensor::lidar:
      return "lidar";
    case Sensor::imu:
      return "imu";
    case Sensor::magnetometer:
      break;
  }
  return "magnetometer";
}

Vector3 to_vector(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

std::vector<Stream> make_streams(const Platform& platform, SensorChoice choice) {
  std::vector<Stream> streams;
  if (choice.imu) streams.push_back({Sensor::imu, 0, platform.imu.topic, "imu.topic"});
  if (choice.lidar) streams.push_back({Sensor::lidar, 0, platform.lidar.topic, "lidar.topic"});
  for (std::size_t i = 0; choice.magnetometers && i < platform.magnetometers.size(); ++i) {
    streams.push_back(
        {Sensor::magnetometer, i, platform.magnetometers[i].topic, fmt::format("magnetometers[{}].topic", i)});
  }
  return streams;
}

/// `message` is one of the two kinds of clouds.
void decode_cloud(PointCloudDecoder& decoder, const ros1::Message& message, LidarScan& scan) {
  if (const auto* livox = std::get_if<ros1::LivoxMessage>(&message)) return decoder.decode(*livox, scan);
  decoder.decode(std::get<ros1::PointCloudMessage>(message), scan);
}

/// A gap is longer than this many IMU periods: a lost packet or two are none.
constexpr double imu_gap_periods = 5.0;

/// A stamp that departs by more from the recorder's clock than the first one did is a broken one. Taken at its word, one
/// stamp in the far future would make all that follow look late.
constexpr Time largest_stamp_jump = 10'000'000'000;

}  // namespace

struct BagSource::Implementation {
  Implementation(const std::string& log_path, const Platform& log_platform, WarningLog& log, SensorChoice choice)
      : path(log_path),
        platform(log_platform),
        warnings(log),
        reader(open_log(log_path, log)),
        messages(log_path),
        decoder(log_path, log_platform, log),
        streams(make_streams(log_platform, choice)) {}

  std::string path;
  Platform platform;
  WarningLog& warnings;
  std::unique_ptr<MessageSource> reader;
  MessageDecoder messages;
  PointCloudDecoder decoder;
  std::vector<Stream> streams;
  ros1::Message message;
  Time record_time = 0;  ///< of `message`
  Time begin = 0;
  Time end = 0;

  const TopicInfo& topic_of(const Stream& stream) const;
  void find_topics();
  void inspect();
  void select();
  bool next_message(std::size_t& index);
  double acceleration_factor() const;
  bool accept(Stream& stream, Time stamp);
  bool read_imu(Stream& stream, const ros1::ImuMessage& imu, Measurement& measurement);
  bool read_field(Stream& stream, const ros1::MagneticFieldMessage& field, Measurement& measurement);
  bool read_scan(Stream& stream, Measurement& measurement);
};

/// Its topic in the log, which find_topics() has seen to be there.
const TopicInfo& BagSource::Implementation::topic_of(const Stream& stream) const {
  return *std::find_if(reader->topics().begin(), reader->topics().end(),
                       [&stream](const TopicInfo& topic) { return topic.name == stream.topic; });
}

/// Reads the next message of a stream into `message`; `index` is the stream's.
bool BagSource::Implementation::next_message(std::size_t& index) {
  RawMessage raw;
  if (!reader->next(raw)) return false;
  index = raw.topic;
  record_time = raw.record_time;
  messages.decode(topic_of(streams[index]), raw, message);
  return true;
}

void BagSource::Implementation::find_topics() {
  if (streams.empty()) throw InputError(path + ": no sensor of the platform is chosen");
  const auto& topics = reader->topics();
  if (topics.empty()) throw InputError(path + ": the log holds no messages");
  std::string list;
  for (const auto& topic : topics) list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", topic.name, topic.type);
  Time record_begin = 0;
  Time record_end = 0;
  for (const Stream& stream : streams) {
    const std::string key = stream.key + " in " + (platform.file.empty() ? "the platform file" : platform.file);
    const auto found = std::find_if(topics.begin(), topics.end(),
                                    [&stream](const TopicInfo& topic) { return topic.name == stream.topic; });
    if (found == topics.end()) {
      std::vector<std::string> of_type;
      for (const auto& topic : topics) {
        if (is_type_of(stream.sensor, topic.type)) of_type.push_back(topic.name);
      }
      const std::string hint = of_type.empty() ? fmt::format("it has no {} at all", type_of(stream.sensor))
                                               : "did you mean " + nearest_name(stream.topic, of_type) + "?";
      const char* silent = stream.sensor == Sensor::magnetometer ? ", or take that magnetometer out if it was silent" : "";
      throw InputError(fmt::format("{}: there is no topic {}; {}; set {}{}; the log has {}", path, stream.topic, hint, key,
                                   silent, list));
    }
    if (!is_type_of(stream.sensor, found->type)) {
      const char* other = stream.sensor == Sensor::lidar ? " or livox_ros_driver2/CustomMsg" : "";
      throw InputError(fmt::format("{}: topic {} is a {}; expected a {}{}; set {}; the log has {}", path, stream.topic,
                                   found->type, type_of(stream.sensor), other, key, list));
    }
    const bool first = &stream == &streams.front();
    record_begin = first ? found->begin : std::min(record_begin, found->begin);
    record_end = first ? found->end : std::max(record_end, found->end);
  }
  begin = record_begin;
  end = record_end;
}

void BagSource::Implementation::select() {
  std::vector<std::string> names;
  for (const Stream& stream : streams) names.push_back(stream.topic);
  reader->select(names);
}

double BagSource::Implementation::acceleration_factor() const {
  constexpr double standard_gravity = 9.80665;
  return platform.imu.acceleration_unit == AccelerationUnit::standard_gravity ? standard_gravity : 1.0;
}

void BagSource::Implementation::inspect() {
  std::vector<FirstReadings> readings(streams.size());
  std::size_t unsatisfied = streams.size();
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::int64_t worth = streams[i].sensor == Sensor::lidar ? 1 : 200;
    readings[i].wanted = static_cast<int>(std::min(worth, topic_of(streams[i]).messages));
  }
  select();
  LidarScan scan;
  for (std::size_t index = 0; unsatisfied > 0 && next_message(index);) {
    FirstReadings& reading = readings[index];
    if (reading.count >= reading.wanted) continue;
    if (const auto* imu = std::get_if<ros1::ImuMessage>(&message)) {
      reading.add(imu->stamp, to_vector(imu->linear_acceleration).norm() * acceleration_factor());
    } else if (const auto* field = std::get_if<ros1::MagneticFieldMessage>(&message)) {
      const double factor = microtesla_per(platform.magnetometers[streams[index].magnetometer].unit);
      reading.add(field->stamp, to_vector(field->field_tesla).norm() * factor);
    } else {
      WarningLog counted_later;
      PointCloudDecoder once(path, platform, counted_later);
      decode_cloud(once, message, scan);
      reading.add(scan.start, 0.0);
    }
    if (reading.count >= reading.wanted) --unsatisfied;
  }
  const double duration_s = to_seconds(end - begin);
  const Time reference = readings.front().first_stamp;
  Time first_stamp = reference;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    check_clock(path, streams[i].topic, readings[i].first_stamp, streams[0].topic, reference, duration_s);
    if (streams[i].sensor == Sensor::imu) check_acceleration(path, platform, readings[i]);
    if (streams[i].sensor == Sensor::magnetometer) check_field(path, platform, streams[i].magnetometer, readings[i]);
    first_stamp = std::min(first_stamp, readings[i].first_stamp);
  }
  end += first_stamp - begin;  // from the recorder's clock to the stamps'
  begin = first_stamp;
}

/// Stamps of one topic must increase: what does not is dropped and counted.
bool BagSource::Implementation::accept(Stream& stream, Time stamp) {
  if (!stream.any) stream.recorder_lag = record_time - stamp;
  const Time jump = stamp - (record_time - stream.recorder_lag);
  if (std::abs(jump) > largest_stamp_jump) {
    warnings.add(std::string(part_of(stream.sensor)) + ".stamp_jump",
                 fmt::format("{}: a stamp is {:.3f} s off the recorder's clock; such messages are dropped", stream.topic,
                             to_seconds(jump)),
                 record_time);
    return false;
  }
  if (stream.any && stamp <= stream.last_stamp) {
    const bool repeated = stamp == stream.last_stamp;
    warnings.add(fmt::format("{}.{}", part_of(stream.sensor), repeated ? "stamp_repeated" : "stamp_back"),
                 fmt::format("{}: a stamp {} {:.6f} s; such messages are dropped", stream.topic,
                             repeated ? "is there twice:" : "goes back by",
                             repeated ? to_seconds(stamp) : to_seconds(stream.last_stamp - stamp)),
                 stamp);
    return false;
  }
  stream.any = true;
  stream.last_stamp = stamp;
  return true;
}

bool BagSource::Implementation::read_imu(Stream& stream, const ros1::ImuMessage& imu, Measurement& measurement) {
  ImuSample sample;
  sample.time = imu.stamp;
  sample.angular_velocity = to_vector(imu.angular_velocity);
  sample.linear_acceleration = to_vector(imu.linear_acceleration) * acceleration_factor();
  if (!sample.angular_velocity.allFinite() || !sample.linear_acceleration.allFinite()) {
    warnings.add("imu.not_finite", stream.topic + ": samples that are not finite were dropped", imu.stamp);
    return false;
  }
  const Time previous = stream.last_stamp;
  const bool first = !stream.any;
  if (!accept(stream, imu.stamp)) return false;
  const double gap_s = to_seconds(imu.stamp - previous);
  if (!first && gap_s > imu_gap_periods / platform.suite.imu.rate_hz) {
    warnings.add("imu.gap", fmt::format("{}: {:.3f} s without a sample at {:.3f} s; expected one every {:g} s", stream.topic,
                                        gap_s, to_seconds(previous), 1.0 / platform.suite.imu.rate_hz),
                 previous);
  }
  measurement = sample;
  return true;
}

bool BagSource::Implementation::read_field(Stream& stream, const ros1::MagneticFieldMessage& field,
                                           Measurement& measurement) {
  MagneticSample sample;
  sample.time = field.stamp;
  sample.magnetometer = static_cast<int>(stream.magnetometer);
  sample.field_ut = to_vector(field.field_tesla) * microtesla_per(platform.magnetometers[stream.magnetometer].unit);
  if (!sample.field_ut.allFinite()) {
    warnings.add("magnetometer.not_finite", stream.topic + ": samples that are not finite were dropped", field.stamp);
    return false;
  }
  if (!accept(stream, field.stamp)) return false;
  measurement = sample;
  return true;
}

bool BagSource::Implementation::read_scan(Stream& stream, Measurement& measurement) {
  LidarScan scan;
  decode_cloud(decoder, message, scan);
  if (!accept(stream, scan.start)) return false;
  measurement = std::move(scan);
  return true;
}

BagSource::BagSource(const std::string& path, const Platform& platform, WarningLog& warnings, SensorChoice choice)
    : implementation_(std::make_unique<Implementation>(path, platform, warnings, choice)) {
  implementation_->find_topics();
  implementation_->inspect();
  implementation_->select();
}

BagSource::~BagSource() = default;

bool BagSource::next(Measurement& measurement) {
  Implementation& self = *implementation_;
  std::size_t index = 0;
  while (self.next_message(index)) {
    Stream& stream = self.streams[index];
    if (const auto* imu = std::get_if<ros1::ImuMessage>(&self.message)) {
      if (self.read_imu(stream, *imu, measurement)) return true;
    } else if (const auto* field = std::get_if<ros1::MagneticFieldMessage>(&self.message)) {
      if (self.read_field(stream, *field, measurement)) return true;
    } else if (self.read_scan(stream, measurement)) {
      return true;
    }
  }
  return false;
}

Time BagSource::begin_time() const { return implementation_->begin; }

Time BagSource::end_time() const { return implementation_->end; }

}  // namespace lodestone
