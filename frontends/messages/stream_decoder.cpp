#include "frontends/messages/stream_decoder.h"

#include "frontends/configuration/platform_lidars.h"

namespace lodestone {
namespace {

constexpr double standard_gravity = 9.80665;

Vector3 to_vector(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

}  // namespace

StreamDecoder::StreamDecoder(const std::string& path, const Platform& platform, WarningLog& warnings)
    : platform_(platform), messages_(path) {
  for (std::size_t lidar = 0; lidar < lidar_count(platform); ++lidar) {
    clouds_.emplace_back(path, platform, lidar, warnings);
  }
}

void StreamDecoder::set(const RawMessage& raw) {
  raw_ = raw;
  message_is_decoded_ = vectors_are_decoded_ = false;
}

const ros1::Message& StreamDecoder::message(const SensorStream& stream) {
  if (!message_is_decoded_) messages_.decode(*stream.info, raw_, message_);
  message_is_decoded_ = true;
  return message_;
}

const MessagePaths::Vector& StreamDecoder::vector(const SensorStream& stream, std::size_t index) {
  if (!vectors_are_decoded_) stream.reader->read(raw_, vectors_);
  vectors_are_decoded_ = true;
  return vectors_[stream.first_vector + index];
}

Time StreamDecoder::clock_offset(const SensorStream& stream) const {
  if (stream.sensor == Sensor::lidar) return from_seconds(layout_of(platform_, stream.index).clock_offset_s);
  if (stream.sensor == Sensor::wheels) return from_seconds(platform_.wheels.clock_offset_s);
  return stream.sensor == Sensor::magnetometer ? from_seconds(platform_.magnetometer_clock_offset_s) : 0;
}

Time StreamDecoder::stamp(const SensorStream& stream) {
  const Time written = stream.reader ? vector(stream, 0).stamp
                                     : std::visit([](const auto& each) { return each.stamp; }, message(stream));
  return written == 0 ? 0 : written - clock_offset(stream);
}

ImuSample StreamDecoder::imu(const SensorStream& stream) {
  const double factor = platform_.imu.acceleration_unit == AccelerationUnit::standard_gravity ? standard_gravity : 1.0;
  if (stream.reader) {
    return {stamp(stream), to_vector(vector(stream, 0).values), to_vector(vector(stream, 1).values) * factor};
  }
  const auto& imu = std::get<ros1::ImuMessage>(message(stream));
  return {imu.stamp, to_vector(imu.angular_velocity), to_vector(imu.linear_acceleration) * factor};
}

MagneticSample StreamDecoder::field(const SensorStream& stream) {
  const double factor = microtesla_per(platform_.magnetometers[stream.index].unit);
  const int index = static_cast<int>(stream.index);
  if (stream.reader) return {stamp(stream), index, to_vector(vector(stream, 0).values) * factor};
  const auto& field = std::get<ros1::MagneticFieldMessage>(message(stream));
  return {stamp(stream), index, to_vector(field.field_tesla) * factor};
}

std::optional<WheelSample> StreamDecoder::wheel_on_each_side(const SensorStream& stream) {
  const WheelMessageLayout& layout = platform_.wheels;
  WheelPositions::Side sides[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string& path = i == 0 ? layout.left_path : layout.right_path;
    const double sign = path.starts_with('-') ? -1.0 : 1.0;
    sides[i] = {sign * vector(stream, i).values[0], stream.reader->period(stream.first_vector + i)};
  }
  std::optional<WheelPositions::Velocities> found{{stamp(stream), sides[0].position, sides[1].position}};
  if (layout.positions) found = wheel_positions_.add(found->time, sides[0], sides[1]);
  if (!found) return std::nullopt;
  return WheelSample{found->time, 0.5 * (found->left + found->right) / layout.scale, 0.0,
                     (found->right - found->left) / (layout.track_m * layout.scale)};
}

std::optional<WheelSample> StreamDecoder::wheels(const SensorStream& stream) {
  if (stream.numbers) return wheel_on_each_side(stream);
  Vector3 linear, angular;
  if (stream.reader) {
    linear = to_vector(vector(stream, 0).values);
    angular = to_vector(vector(stream, 1).values);
  } else {
    const auto& odometry = std::get<ros1::OdometryMessage>(message(stream));
    linear = to_vector(odometry.linear_velocity);
    angular = to_vector(odometry.angular_velocity);
  }
  linear /= platform_.wheels.scale;
  return WheelSample{stamp(stream), linear.x(), linear.y(), angular.z()};
}

void StreamDecoder::scan(const SensorStream& stream, LidarScan& scan) {
  PointCloudDecoder& decoder = clouds_[stream.index];
  if (const auto* livox = std::get_if<ros1::LivoxMessage>(&message(stream))) {
    decoder.decode(*livox, scan);
  } else {
    decoder.decode(std::get<ros1::PointCloudMessage>(message(stream)), scan);
  }
  scan.start -= clock_offset(stream);
  scan.end -= clock_offset(stream);
}

const ros1::PointCloudMessage* StreamDecoder::cloud(const SensorStream& stream) {
  return std::get_if<ros1::PointCloudMessage>(&message(stream));
}

Vector3 calibrated(const MagnetometerMessageLayout& layout, const Vector3& reading_ut) {
  return layout.calibrated() ? Vector3(layout.soft_iron_correction * (reading_ut - layout.hard_iron_ut)) : reading_ut;
}

}  // namespace lodestone
