#pragma once

#include <array>

#include "frontends/messages/wire_ros1.h"

/// Writers of the fields of each known message; the counterpart of message_reading.h.
namespace lodestone::writing {

inline const char* type_of(const ros1::PointCloudMessage&) {
  return "sensor_msgs/PointCloud2";
}
inline const char* type_of(const ros1::LivoxMessage&) {
  return "livox_ros_driver2/CustomMsg";
}
inline const char* type_of(const ros1::ImuMessage&) {
  return "sensor_msgs/Imu";
}
inline const char* type_of(const ros1::MagneticFieldMessage&) {
  return "sensor_msgs/MagneticField";
}
inline const char* type_of(const ros1::OdometryMessage&) {
  return "nav_msgs/Odometry";
}

inline void write_numbers(Ros1WireWriter& wire, const std::array<double, 3>& values) {
  for (const double value : values) wire.number(value);
}
inline void write_zeros(Ros1WireWriter& wire, int count) {
  for (int i = 0; i < count; ++i) wire.number(0.0);
}

/// `Wire`: the writer of ROS 1, or of CDR.
template <class Wire>
void write(Wire& wire, const ros1::PointCloudMessage& message) {
  wire.header(message.stamp, message.frame);
  wire.number(message.height);
  wire.number(message.width);
  wire.number(static_cast<std::uint32_t>(message.fields.size()));
  for (const ros1::PointField& field : message.fields) {
    wire.text(field.name);
    wire.number(field.offset);
    wire.number(field.datatype);
    wire.number(field.count);
  }
  wire.number(static_cast<std::uint8_t>(message.big_endian));
  wire.number(message.point_step);
  wire.number(message.row_step);
  wire.number(static_cast<std::uint32_t>(message.data_size));
  wire.bytes(message.data, message.data_size);
  wire.number(static_cast<std::uint8_t>(message.dense));
}

inline void write(Ros1WireWriter& wire, const ros1::LivoxMessage& message) {
  wire.header(message.stamp, message.frame);
  wire.number(message.timebase);
  wire.number(message.point_count);
  wire.number(message.lidar_id);
  for (int i = 0; i < 3; ++i) wire.number(std::uint8_t{0});
  wire.number(static_cast<std::uint32_t>(message.data_size / ros1::LivoxMessage::point_step));
  wire.bytes(message.data, message.data_size);
}

inline void write(Ros1WireWriter& wire, const ros1::ImuMessage& message) {
  wire.header(message.stamp, message.frame);
  write_numbers(wire, {0.0, 0.0, 0.0});
  wire.number(1.0);   // identity orientation
  wire.number(-1.0);  // sensor_msgs/Imu: no orientation in this message
  write_zeros(wire, 8);
  write_numbers(wire, message.angular_velocity);
  write_zeros(wire, 9);
  write_numbers(wire, message.linear_acceleration);
  write_zeros(wire, 9);
}

inline void write(Ros1WireWriter& wire, const ros1::MagneticFieldMessage& message) {
  wire.header(message.stamp, message.frame);
  write_numbers(wire, message.field_tesla);
  write_zeros(wire, 9);  // sensor_msgs/MagneticField: zeros mean "covariance unknown"
}

inline void write(Ros1WireWriter& wire, const ros1::OdometryMessage& message) {
  wire.header(message.stamp, message.frame);
  wire.text(message.child_frame);
  write_numbers(wire, {0.0, 0.0, 0.0});
  write_zeros(wire, 3);
  wire.number(1.0);  // identity orientation
  write_zeros(wire, 36);
  write_numbers(wire, message.linear_velocity);
  write_numbers(wire, message.angular_velocity);
  write_zeros(wire, 36);
}

}  // namespace lodestone::writing
