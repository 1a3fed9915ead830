#pragma once

#include <string>

#include "frontends/messages/known_types.h"
#include "frontends/messages/message_reading.h"

/// Copies known messages field by field between wire formats. `From` is a reader, `To` a writer of wire_*.h.
namespace lodestone::transcoding {

template <class From, class To>
struct Copier {
  From& from;
  To& to;
  std::string text_buffer{};

  template <class Number>
  Number number() {
    const auto value = from.template number<Number>();
    to.number(value);
    return value;
  }
  template <class Number>
  void numbers(int count) {
    for (int i = 0; i < count; ++i) number<Number>();
  }
  void text() {
    from.text(text_buffer);
    to.text(text_buffer);
  }
  void header() {
    const Time stamp = from.header(text_buffer);
    if (stamp < 0 || stamp / 1'000'000'000 > 0x7FFFFFFF) {
      throw ros1::MalformedMessage("a stamp of " + std::to_string(stamp) + " ns fits only one of ROS 1 and ROS 2");
    }
    to.header(stamp, text_buffer);
  }
  std::uint32_t list(std::size_t smallest) {
    const std::uint32_t count = reading::list_size(from, smallest);
    to.number(count);
    return count;
  }
  void octets() {
    const std::uint32_t count = list(1);
    const std::uint8_t* data = from.bytes(count);
    to.bytes(data, count);
  }
};

template <class From, class To>
void copy(MessageType type, From& from, To& to) {
  Copier<From, To> copier{from, to};
  copier.header();
  switch (type) {
    case MessageType::point_cloud: {
      copier.template numbers<std::uint32_t>(2);  // height, width
      const std::uint32_t fields = copier.list(13);
      for (std::uint32_t i = 0; i < fields; ++i) {
        copier.text();
        copier.template number<std::uint32_t>();  // offset
        copier.template number<std::uint8_t>();   // datatype
        copier.template number<std::uint32_t>();  // count
      }
      copier.template number<std::uint8_t>();     // is_bigendian
      copier.template numbers<std::uint32_t>(2);  // point_step, row_step
      copier.octets();
      copier.template number<std::uint8_t>();  // is_dense
      return;
    }
    case MessageType::livox: {
      copier.template number<std::uint64_t>();   // timebase
      copier.template number<std::uint32_t>();   // point_num
      copier.template numbers<std::uint8_t>(4);  // lidar_id, rsvd
      const std::uint32_t points = copier.list(ros1::LivoxMessage::point_step);
      for (std::uint32_t i = 0; i < points; ++i) {
        copier.template number<std::uint32_t>();   // offset_time
        copier.template numbers<float>(3);         // x, y, z
        copier.template numbers<std::uint8_t>(3);  // reflectivity, tag, line
      }
      return;
    }
    case MessageType::imu:
      return copier.template numbers<double>(4 + 3 * 9 + 2 * 3);
    case MessageType::magnetic_field:
      return copier.template numbers<double>(3 + 9);
    case MessageType::odometry:
      copier.text();  // child_frame_id
      return copier.template numbers<double>(3 + 4 + 36 + 2 * 3 + 36);
    case MessageType::other:
      return;
  }
}

}  // namespace lodestone::transcoding
