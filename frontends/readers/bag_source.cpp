#include "frontends/readers/bag_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <optional>

#include "frontends/readers/bag_streams.h"
#include "frontends/readers/logs/message_decoder.h"
#include "frontends/readers/logs/open_log.h"
#include "frontends/readers/point_cloud_decoder.h"
#include "frontends/readers/scan_merger.h"
#include "frontends/readers/sensor_checks.h"

namespace lodestone {
namespace {

Vector3 to_vector(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

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
        streams(make_streams(log_platform, choice)) {
    for (std::size_t lidar = 0; lidar <= platform.further_lidars.size(); ++lidar) {
      decoders.emplace_back(path, platform, lidar, warnings);
    }
    if (choice.lidar && !platform.further_lidars.empty()) {
      std::vector<LidarModel> others;
      for (const FurtherLidar& each : platform.further_lidars) others.push_back(each.model);
      merger.emplace(platform.suite.lidar, others, warnings);
    }
  }

  std::string path;
  Platform platform;
  WarningLog& warnings;
  std::unique_ptr<MessageSource> reader;
  MessageDecoder messages;
  std::vector<PointCloudDecoder> decoders;  ///< one a LiDAR
  std::optional<ScanMerger> merger;         ///< of several LiDARs
  std::vector<SensorStream> streams;
  std::vector<std::string> topics;  ///< that are chosen
  ros1::Message message;
  std::vector<MessagePaths::Vector> vectors;  ///< of a message that is read by paths
  Time record_time = 0;                       ///< of the message that was read last
  std::deque<Measurement> ready;
  Time begin = 0;
  Time end = 0;

  const TopicInfo& topic_of(const SensorStream& stream) const;
  void choose();
  void inspect();
  double magnitude_of(const SensorStream& stream, Time& stamp);
  bool read_message(RawMessage& raw);
  void decode(const SensorStream& stream, const RawMessage& raw);
  double acceleration_factor() const;
  bool accept(SensorStream& stream, Time stamp);
  void take_message(const RawMessage& raw);
  void take_imu(SensorStream& stream, ImuSample sample);
  void take_field(SensorStream& stream, MagneticSample sample);
  void take_scan(SensorStream& stream);
  ImuSample imu_sample(const SensorStream& stream) const;
  MagneticSample field_sample(const SensorStream& stream) const;
};

/// Its topic in the log, which find_topics() has seen to be there.
const TopicInfo& BagSource::Implementation::topic_of(const SensorStream& stream) const {
  return *std::find_if(reader->topics().begin(), reader->topics().end(),
                       [&stream](const TopicInfo& topic) { return topic.name == stream.topic; });
}

void BagSource::Implementation::choose() {
  topics = find_topics(path, platform, reader->topics(), streams);
  for (const SensorStream& stream : streams) {
    const TopicInfo& topic = topic_of(stream);
    const bool first = &stream == &streams.front();
    begin = first ? topic.begin : std::min(begin, topic.begin);
    end = first ? topic.end : std::max(end, topic.end);
  }
}

bool BagSource::Implementation::read_message(RawMessage& raw) {
  if (!reader->next(raw)) return false;
  record_time = raw.record_time;
  return true;
}

/// Into `message`, or into `vectors` where the stream has paths.
void BagSource::Implementation::decode(const SensorStream& stream, const RawMessage& raw) {
  if (stream.reader) {
    stream.reader->read(raw, vectors);
  } else {
    messages.decode(topic_of(stream), raw, message);
  }
}

double BagSource::Implementation::acceleration_factor() const {
  constexpr double standard_gravity = 9.80665;
  return platform.imu.acceleration_unit == AccelerationUnit::standard_gravity ? standard_gravity : 1.0;
}

ImuSample BagSource::Implementation::imu_sample(const SensorStream& stream) const {
  const double factor = acceleration_factor();
  if (stream.reader) return {vectors[0].stamp, to_vector(vectors[0].values), to_vector(vectors[1].values) * factor};
  const auto& imu = std::get<ros1::ImuMessage>(message);
  return {imu.stamp, to_vector(imu.angular_velocity), to_vector(imu.linear_acceleration) * factor};
}

MagneticSample BagSource::Implementation::field_sample(const SensorStream& stream) const {
  const double factor = microtesla_per(platform.magnetometers[stream.index].unit);
  const int index = static_cast<int>(stream.index);
  if (stream.reader) return {vectors[0].stamp, index, to_vector(vectors[0].values) * factor};
  const auto& field = std::get<ros1::MagneticFieldMessage>(message);
  return {field.stamp, index, to_vector(field.field_tesla) * factor};
}

/// Of what decode() has read, in the unit of the measurement; 0 of a scan, which is decoded to see whether it can be.
double BagSource::Implementation::magnitude_of(const SensorStream& stream, Time& stamp) {
  if (stream.sensor == Sensor::imu) {
    const ImuSample sample = imu_sample(stream);
    stamp = sample.time;
    return sample.linear_acceleration.norm();
  }
  if (stream.sensor == Sensor::magnetometer) {
    const MagneticSample sample = field_sample(stream);
    stamp = sample.time;
    return sample.field_ut.norm();
  }
  WarningLog counted_later;
  PointCloudDecoder once(path, platform, stream.index, counted_later);
  LidarScan scan;
  decode_cloud(once, message, scan);
  stamp = scan.start;
  return 0.0;
}

void BagSource::Implementation::inspect() {
  std::vector<FirstReadings> readings(streams.size());
  std::size_t unsatisfied = streams.size();
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::int64_t worth = streams[i].sensor == Sensor::lidar ? 1 : 200;
    readings[i].wanted = static_cast<int>(std::min(worth, topic_of(streams[i]).messages));
  }
  reader->select(topics);
  for (RawMessage raw; unsatisfied > 0 && read_message(raw);) {
    for (std::size_t i = 0; i < streams.size(); ++i) {
      FirstReadings& reading = readings[i];
      if (streams[i].topic_index != raw.topic || reading.count >= reading.wanted) continue;
      decode(streams[i], raw);
      Time stamp = 0;
      const double magnitude = magnitude_of(streams[i], stamp);
      reading.add(stamp, magnitude);
      if (reading.count >= reading.wanted) --unsatisfied;
    }
  }
  const double duration_s = to_seconds(end - begin);
  const Time reference = readings.front().first_stamp;
  Time first_stamp = reference;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    check_clock(path, streams[i].topic, readings[i].first_stamp, streams[0].topic, reference, duration_s);
    if (streams[i].sensor == Sensor::imu) check_acceleration(path, platform, readings[i]);
    if (streams[i].sensor == Sensor::magnetometer) check_field(path, platform, streams[i].index, readings[i], &warnings);
    first_stamp = std::min(first_stamp, readings[i].first_stamp);
  }
  end += first_stamp - begin;  // from the recorder's clock to the stamps'
  begin = first_stamp;
}

/// Stamps of one topic must increase: what does not is dropped and counted.
bool BagSource::Implementation::accept(SensorStream& stream, Time stamp) {
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

void BagSource::Implementation::take_imu(SensorStream& stream, ImuSample sample) {
  if (!sample.angular_velocity.allFinite() || !sample.linear_acceleration.allFinite()) {
    warnings.add("imu.not_finite", stream.topic + ": samples that are not finite were dropped", sample.time);
    return;
  }
  const Time previous = stream.last_stamp;
  const bool first = !stream.any;
  if (!accept(stream, sample.time)) return;
  const double gap_s = to_seconds(sample.time - previous);
  if (!first && gap_s > imu_gap_periods / platform.suite.imu.rate_hz) {
    warnings.add("imu.gap", fmt::format("{}: {:.3f} s without a sample at {:.3f} s; expected one every {:g} s", stream.topic,
                                        gap_s, to_seconds(previous), 1.0 / platform.suite.imu.rate_hz),
                 previous);
  }
  ready.emplace_back(sample);
}

void BagSource::Implementation::take_field(SensorStream& stream, MagneticSample sample) {
  if (!sample.field_ut.allFinite()) {
    warnings.add("magnetometer.not_finite", stream.topic + ": samples that are not finite were dropped", sample.time);
    return;
  }
  const MagnetometerMessageLayout& layout = platform.magnetometers[stream.index];
  if (layout.calibrated()) sample.field_ut = layout.soft_iron_correction * (sample.field_ut - layout.hard_iron_ut);
  if (accept(stream, sample.time)) ready.emplace_back(sample);
}

void BagSource::Implementation::take_scan(SensorStream& stream) {
  LidarScan scan;
  decode_cloud(decoders[stream.index], message, scan);
  if (!accept(stream, scan.start)) return;
  if (!merger) {
    ready.emplace_back(std::move(scan));
    return;
  }
  merger->add(stream.index, std::move(scan));
  for (LidarScan merged; merger->take(merged);) ready.emplace_back(std::move(merged));
}

/// Gives the message to all sensors of its topic.
void BagSource::Implementation::take_message(const RawMessage& raw) {
  for (SensorStream& stream : streams) {
    if (stream.topic_index != raw.topic) continue;
    decode(stream, raw);
    if (stream.sensor == Sensor::imu) take_imu(stream, imu_sample(stream));
    if (stream.sensor == Sensor::magnetometer) take_field(stream, field_sample(stream));
    if (stream.sensor == Sensor::lidar) take_scan(stream);
  }
}

BagSource::BagSource(const std::string& path, const Platform& platform, WarningLog& warnings, SensorChoice choice)
    : implementation_(std::make_unique<Implementation>(path, platform, warnings, choice)) {
  implementation_->choose();
  implementation_->inspect();
  implementation_->reader->select(implementation_->topics);
}

BagSource::~BagSource() = default;

bool BagSource::next(Measurement& measurement) {
  Implementation& self = *implementation_;
  for (RawMessage raw; self.ready.empty();) {
    if (self.read_message(raw)) {
      self.take_message(raw);
      continue;
    }
    if (!self.merger) return false;
    self.merger->finish();
    LidarScan merged;
    if (!self.merger->take(merged)) return false;
    self.ready.emplace_back(std::move(merged));
  }
  measurement = std::move(self.ready.front());
  self.ready.pop_front();
  return true;
}

Time BagSource::begin_time() const { return implementation_->begin; }

Time BagSource::end_time() const { return implementation_->end; }

}  // namespace lodestone
