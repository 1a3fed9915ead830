#include "frontends/synchronizer/bag_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>

#include "core/imu/gap_noise.h"
#include "frontends/logs/open_log.h"
#include "frontends/messages/bag_streams.h"
#include "frontends/messages/sensor_checks.h"
#include "frontends/messages/stream_decoder.h"
#include "frontends/synchronizer/scan_merger.h"
#include "frontends/synchronizer/stamp_order.h"

namespace lodestone {
namespace {

/// A longer silence of all sensors occurs only in logs that were stopped or joined. The log ends there, unless pauses
/// are bridged.
constexpr Time longest_silence = 60'000'000'000;

/// Number of scans that are decoded to estimate the lag of the recorder's clock; a single one may be an outlier.
constexpr std::int64_t first_scans = 3;

/// Adds the first readings of a stream's sensor, in the unit of the measurement; of scans, which are decoded as a
/// check, only the start times. Returns the stamp.
Time add_first(StreamDecoder& decoder, const SensorStream& stream, FirstReadings& readings) {
  if (stream.sensor == Sensor::imu) {
    const ImuSample sample = decoder.imu(stream);
    readings.add(sample.time, sample.linear_acceleration.norm());
    return sample.time;
  }
  if (stream.sensor == Sensor::magnetometer) {
    const MagneticSample sample = decoder.field(stream);
    readings.add(sample.time, sample.field_ut.norm());
    return sample.time;
  }
  if (stream.sensor == Sensor::wheels) {
    const std::optional<WheelSample> sample = decoder.wheels(stream);
    if (sample) readings.add(sample->time, std::abs(sample->forward_velocity_m_s));
    return decoder.stamp(stream);
  }
  LidarScan scan;
  decoder.scan(stream, scan);
  readings.add(scan.start, 0.0);
  return scan.start;
}

}  // namespace

struct BagSource::Implementation {
  Implementation(const std::string& log_path, const Platform& log_platform, WarningLog& log, SensorChoice choice,
                 LogPause log_pause)
      : path(log_path),
        platform(log_platform),
        pause(log_pause),
        warnings(log),
        reader(open_log(log_path, log)),
        decoder(path, platform, log),
        streams(make_streams(log_platform, choice)),
        orders(streams.size()) {
    if (choice.lidar && !platform.further_lidars.empty()) {
      merger.emplace(platform.suite.lidar, platform.suite.further_lidars, warnings);
    }
  }

  std::string path;
  Platform platform;
  LogPause pause;
  WarningLog& warnings;
  std::unique_ptr<MessageSource> reader;
  StreamDecoder decoder;
  std::optional<ScanMerger> merger;  ///< only with several LiDARs
  std::vector<SensorStream> streams;
  std::vector<StampOrder> orders;   ///< one per stream
  std::vector<std::string> topics;  ///< chosen topics
  Time record_time = 0;             ///< of the last message
  Time first_recorded = 0;          ///< time of the first message of all topics
  std::deque<Measurement> ready;
  Time begin = 0;
  Time end = 0;
  std::optional<Time> newest;  ///< completion time of the newest measurement
  bool broken_off = false;

  void choose();
  void inspect();
  bool read_message(RawMessage& raw);
  bool accept(const SensorStream& stream, StampOrder& order, Time stamp);
  bool goes_on(const Measurement& measurement);
  void take_message(const RawMessage& raw);
  void take_imu(const SensorStream& stream, StampOrder& order);
  void take_field(const SensorStream& stream, StampOrder& order);
  void take_wheels(const SensorStream& stream, StampOrder& order);
  void take_scan(const SensorStream& stream, StampOrder& order);
};

void BagSource::Implementation::choose() {
  topics = find_topics(path, platform, reader->topics(), streams);
  first_recorded = std::numeric_limits<Time>::max();
  for (const TopicInfo& topic : reader->topics()) {
    if (topic.messages > 0) first_recorded = std::min(first_recorded, topic.begin);
  }
  for (const SensorStream& stream : streams) {
    const TopicInfo& topic = *stream.info;
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

void BagSource::Implementation::inspect() {
  std::vector<FirstReadings> readings(streams.size());
  std::size_t unsatisfied = streams.size();
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::int64_t worth = streams[i].sensor == Sensor::lidar ? first_scans : 200;
    readings[i].wanted = static_cast<int>(std::min(worth, streams[i].info->messages));
  }
  std::vector<std::vector<Time>> lags(streams.size());
  WarningLog counted_later;
  StreamDecoder first(path, platform, counted_later);  // its warnings are repeated when the scans are read
  reader->select(topics);
  for (RawMessage raw; unsatisfied > 0 && read_message(raw);) {
    first.set(raw);
    for (std::size_t i = 0; i < streams.size(); ++i) {
      FirstReadings& reading = readings[i];
      if (streams[i].topic_index != raw.topic || reading.count >= reading.wanted) continue;
      lags[i].push_back(record_time - add_first(first, streams[i], reading));
      if (reading.count >= reading.wanted) --unsatisfied;
    }
  }
  const double duration_s = to_seconds(end - begin);
  const Time reference = readings.front().first_stamp;
  Time first_stamp = reference;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    check_clock(path, streams[i].topic, readings[i].first_stamp, streams[0].topic, reference, duration_s);
    if (streams[i].sensor == Sensor::imu) check_acceleration(path, platform, readings[i]);
    if (streams[i].sensor == Sensor::magnetometer)
      check_field(path, platform, streams[i].index, readings[i], &warnings);
    first_stamp = std::min(first_stamp, readings[i].first_stamp);
  }
  for (std::size_t i = 0; i < streams.size(); ++i) orders[i] = StampOrder(lags[i]);
  const Time lag = orders.front().usual_lag();  // recorder's clock minus stamps
  if (std::abs(lag) <= farthest_time) end -= lag;
  begin = first_stamp;
}

/// Stamps of one topic must increase; messages with other stamps are discarded and counted.
bool BagSource::Implementation::accept(const SensorStream& stream, StampOrder& order, Time stamp) {
  const StampOrder::Verdict verdict = order.judge(record_time, stamp);
  if (verdict.what == StampOrder::Verdict::broken) {
    warnings.add(std::string(part_of(stream.sensor)) + ".stamp_jump",
                 fmt::format("{}: a stamp is {:.3f} s off the recorder's clock; such messages are discarded",
                             stream.topic, verdict.off_s),
                 record_time);
    return false;
  }
  if (verdict.what == StampOrder::Verdict::recorder_leapt) {
    warnings.add("log.recorder_clock",
                 fmt::format("{}: the recorder's clock jumps by {:.3f} s; the stamps are continuous and are used",
                             stream.topic, verdict.off_s),
                 stamp);
  }
  if (order.any() && stamp <= order.last_stamp()) {
    const bool repeated = stamp == order.last_stamp();
    warnings.add(fmt::format("{}.{}", part_of(stream.sensor), repeated ? "stamp_repeated" : "stamp_back"),
                 fmt::format("{}: a stamp {} {:.6f} s; such messages are discarded", stream.topic,
                             repeated ? "is repeated:" : "goes back by",
                             repeated ? to_seconds(stamp) : to_seconds(order.last_stamp() - stamp)),
                 stamp);
    return false;
  }
  order.take(record_time, stamp);
  return true;
}

void BagSource::Implementation::take_imu(const SensorStream& stream, StampOrder& order) {
  const ImuSample sample = decoder.imu(stream);
  if (!sample.angular_velocity.allFinite() || !sample.linear_acceleration.allFinite()) {
    warnings.add("imu.not_finite", stream.topic + ": samples that are not finite were discarded", sample.time);
    return;
  }
  const Time previous = order.last_stamp();
  const bool first = !order.any();
  if (!accept(stream, order, sample.time)) return;
  const double gap_s = to_seconds(sample.time - previous);
  if (!first && gap_s > kImuGapPeriods / platform.suite.imu.rate_hz) {
    warnings.add("imu.gap",
                 fmt::format("{}: {:.3f} s without a sample at {:.3f} s; expected one every {:g} s", stream.topic,
                             gap_s, to_seconds(previous), 1.0 / platform.suite.imu.rate_hz),
                 previous);
  }
  ready.emplace_back(sample);
}

void BagSource::Implementation::take_field(const SensorStream& stream, StampOrder& order) {
  MagneticSample sample = decoder.field(stream);
  if (!sample.field_ut.allFinite()) {
    warnings.add("magnetometer.not_finite", stream.topic + ": samples that are not finite were discarded", sample.time);
    return;
  }
  sample.field_ut = calibrated(platform.magnetometers[stream.index], sample.field_ut);
  if (accept(stream, order, sample.time)) ready.emplace_back(sample);
}

void BagSource::Implementation::take_wheels(const SensorStream& stream, StampOrder& order) {
  const std::optional<WheelSample> sample = decoder.wheels(stream);
  if (!sample) return;
  if (!std::isfinite(sample->forward_velocity_m_s + sample->lateral_velocity_m_s + sample->yaw_rate_rad_s)) {
    warnings.add("wheels.not_finite", stream.topic + ": samples that are not finite were discarded", sample->time);
    return;
  }
  if (accept(stream, order, sample->time)) ready.emplace_back(*sample);
}

void BagSource::Implementation::take_scan(const SensorStream& stream, StampOrder& order) {
  LidarScan scan;
  decoder.scan(stream, scan);
  if (!accept(stream, order, scan.start)) return;
  if (!merger) {
    ready.emplace_back(std::move(scan));
    return;
  }
  merger->add(stream.index, std::move(scan));
  for (LidarScan merged; merger->take(merged);) ready.emplace_back(std::move(merged));
}

/// Passes the message to all sensors of its topic.
void BagSource::Implementation::take_message(const RawMessage& raw) {
  decoder.set(raw);
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const SensorStream& stream = streams[i];
    if (stream.topic_index != raw.topic) continue;
    if (stream.sensor == Sensor::imu) take_imu(stream, orders[i]);
    if (stream.sensor == Sensor::magnetometer) take_field(stream, orders[i]);
    if (stream.sensor == Sensor::wheels) take_wheels(stream, orders[i]);
    if (stream.sensor == Sensor::lidar) take_scan(stream, orders[i]);
  }
}

BagSource::BagSource(const std::string& path, const Platform& platform, WarningLog& warnings, SensorChoice choice,
                     LogPause pause)
    : implementation_(std::make_unique<Implementation>(path, platform, warnings, choice, pause)) {
  implementation_->choose();
  implementation_->inspect();
  implementation_->reader->select(implementation_->topics);
}

BagSource::~BagSource() = default;

/// Returns false from the first measurement that follows a pause which ends the log.
bool BagSource::Implementation::goes_on(const Measurement& measurement) {
  const Time complete = completion_time(measurement);
  if (pause == LogPause::ends_the_log && newest && complete - *newest > longest_silence) {
    broken_off = true;
    const double cut_s = std::floor(to_seconds(record_time) - to_seconds(first_recorded));
    warnings.add("log.broken_off",
                 fmt::format("{}: no sensor has data for {:.0f} s; the log is read up to this gap, because the motion "
                             "within it is unknown; cut the log (lodestone convert --to {:.0f}, and --from {:.0f}) and "
                             "give each part its own initial pose",
                             path, to_seconds(complete - *newest), cut_s, cut_s),
                 *newest);
    return false;
  }
  newest = newest ? std::max(*newest, complete) : complete;
  return true;
}

bool BagSource::next(Measurement& measurement) {
  Implementation& self = *implementation_;
  if (self.broken_off) return false;
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
  if (!self.goes_on(self.ready.front())) return false;
  measurement = std::move(self.ready.front());
  self.ready.pop_front();
  return true;
}

Time BagSource::begin_time() const {
  return implementation_->begin;
}

Time BagSource::end_time() const {
  return implementation_->end;
}

}  // namespace lodestone
