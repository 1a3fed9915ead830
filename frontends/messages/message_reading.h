#pragma once

#include <algorithm>
#include <cstring>
#include <vector>

#include "frontends/messages/ros_messages.h"

/// Readers of the fields of each known message, for both wire formats: `Wire` is Ros1WireReader or CdrWireReader.
namespace lodestone::reading {

/// Count of a list with elements of at least `smallest` bytes, checked before memory is allocated.
template <class Wire>
std::uint32_t list_size(Wire& wire, std::size_t smallest) {
  const auto count = wire.template number<std::uint32_t>();
  if (count > wire.left() / smallest) {
    throw ros1::MalformedMessage("a list announces " + std::to_string(count) + " elements in " +
                                 std::to_string(wire.left()) + " bytes");
  }
  return count;
}

template <class Wire>
void read_numbers(Wire& wire, int count) {
  for (int i = 0; i < count; ++i) wire.template number<double>();
}

template <class Wire>
void read_vector(Wire& wire, std::array<double, 3>& vector) {
  for (double& value : vector) value = wire.template number<double>();
}

template <class Wire>
void read(Wire& wire, ros1::PointCloudMessage& message, std::vector<std::uint8_t>&) {
  message.stamp = wire.header(message.frame);
  message.height = wire.template number<std::uint32_t>();
  message.width = wire.template number<std::uint32_t>();
  message.fields.resize(list_size(wire, 13));  // an empty name with its size, offset, datatype and count
  for (ros1::PointField& field : message.fields) {
    wire.text(field.name);
    field.offset = wire.template number<std::uint32_t>();
    field.datatype = wire.template number<std::uint8_t>();
    field.count = wire.template number<std::uint32_t>();
  }
  message.big_endian = wire.template number<std::uint8_t>() != 0;
  message.point_step = wire.template number<std::uint32_t>();
  message.row_step = wire.template number<std::uint32_t>();
  message.data_size = list_size(wire, 1);
  message.data = wire.bytes(message.data_size);
  message.dense = wire.template number<std::uint8_t>() != 0;
}

template <class Wire>
void read(Wire& wire, ros1::ImuMessage& message, std::vector<std::uint8_t>&) {
  message.stamp = wire.header(message.frame);
  read_numbers(wire, 4 + 9);  // orientation and its covariance
  read_vector(wire, message.angular_velocity);
  read_numbers(wire, 9);
  read_vector(wire, message.linear_acceleration);
  read_numbers(wire, 9);
}

template <class Wire>
void read(Wire& wire, ros1::MagneticFieldMessage& message, std::vector<std::uint8_t>&) {
  message.stamp = wire.header(message.frame);
  read_vector(wire, message.field_tesla);
  read_numbers(wire, 9);
}

template <class Wire>
void read(Wire& wire, ros1::OdometryMessage& message, std::vector<std::uint8_t>&) {
  message.stamp = wire.header(message.frame);
  wire.text(message.child_frame);
  read_numbers(wire, 3 + 4 + 36);  // pose and its covariance
  read_vector(wire, message.linear_velocity);
  read_vector(wire, message.angular_velocity);
  read_numbers(wire, 36);
}

/// Bytes from one point of a Livox message to the next: CDR aligns each point's first number.
constexpr std::size_t point_stride(bool aligned) {
  return aligned ? 20 : ros1::LivoxMessage::point_step;
}

/// Packs points that are aligned or big-endian.
inline const std::uint8_t* packed_points(const std::uint8_t* data, std::size_t count, bool swapped,
                                         std::vector<std::uint8_t>& points) {
  constexpr std::size_t step = ros1::LivoxMessage::point_step;
  points.resize(count * step);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint8_t* point = points.data() + i * step;
    std::memcpy(point, data + i * point_stride(true), step);
    for (std::uint8_t* number = point; swapped && number < point + 16; number += 4) std::reverse(number, number + 4);
  }
  return points.data();
}

template <class Wire>
void read_livox(Wire& wire, ros1::LivoxMessage& message, std::vector<std::uint8_t>& points, bool aligned) {
  message.stamp = wire.header(message.frame);
  message.timebase = wire.template number<std::uint64_t>();
  message.point_count = wire.template number<std::uint32_t>();
  message.lidar_id = wire.template number<std::uint8_t>();
  wire.bytes(3);
  const std::size_t listed = wire.template number<std::uint32_t>();
  constexpr std::size_t step = ros1::LivoxMessage::point_step;
  const std::size_t bytes =
      listed == 0 ? 0 : (listed - 1) * point_stride(aligned) + step;  // the last point has no padding
  // CDR may be padded to a multiple of four at its end.
  const bool fits = aligned ? wire.left() >= bytes && wire.left() - bytes < 4 : wire.left() == bytes;
  if (listed != message.point_count || !fits) {
    throw ros1::MalformedMessage("the CustomMsg announces " + std::to_string(message.point_count) +
                                 " points, but has a list of " + std::to_string(listed) + " in " +
                                 std::to_string(wire.left()) + " bytes; expected " +
                                 std::to_string(point_stride(aligned)) + " bytes per point");
  }
  message.data = wire.bytes(bytes);
  if (aligned) message.data = packed_points(message.data, listed, wire.swapped(), points);
  message.data_size = listed * step;
}

}  // namespace lodestone::reading
