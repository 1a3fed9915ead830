#pragma once

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/messages/ros_messages.h"

/// ROS 1's serialization: packed little-endian numbers; lists and texts follow their count.
namespace lodestone {

/// Reads one message. Every call throws ros1::MalformedMessage if the bytes end before.
class Ros1WireReader {
 public:
  Ros1WireReader(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}

  std::size_t left() const { return static_cast<std::size_t>(end_ - data_); }
  bool swapped() const { return false; }

  const std::uint8_t* bytes(std::size_t count) {
    if (count > left()) {
      throw ros1::MalformedMessage("the message ends " + std::to_string(count - left()) +
                                   " bytes before the end of its content");
    }
    const std::uint8_t* at = data_;
    data_ += count;
    return at;
  }
  template <class Number>
  Number number() {
    Number value;
    std::memcpy(&value, bytes(sizeof(value)), sizeof(value));
    return value;
  }
  void text(std::string& value) {
    const auto size = number<std::uint32_t>();
    value.assign(reinterpret_cast<const char*>(bytes(size)), size);
  }
  /// Stamp and frame of a std_msgs/Header.
  Time header(std::string& frame) {
    number<std::uint32_t>();  // seq
    const auto seconds = number<std::uint32_t>();
    const auto nanoseconds = number<std::uint32_t>();
    text(frame);
    return Time{seconds} * 1'000'000'000 + nanoseconds;
  }

 private:
  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

/// Writes one message.
class Ros1WireWriter {
 public:
  void bytes(const std::uint8_t* data, std::size_t count) {
    if (count > 0) data_.insert(data_.end(), data, data + count);
  }
  template <class Number>
  void number(Number value) {
    std::array<std::uint8_t, sizeof(Number)> raw;
    std::memcpy(raw.data(), &value, sizeof(value));
    bytes(raw.data(), raw.size());
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes(reinterpret_cast<const std::uint8_t*>(value.data()), value.size());
  }
  void header(Time stamp, const std::string& frame) {
    number(std::uint32_t{0});
    number(static_cast<std::uint32_t>(stamp / 1'000'000'000));
    number(static_cast<std::uint32_t>(stamp % 1'000'000'000));
    text(frame);
  }
  std::vector<std::uint8_t> take() { return std::move(data_); }

 private:
  std::vector<std::uint8_t> data_;
};

}  // namespace lodestone
