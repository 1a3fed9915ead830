#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/exceptions/Exception.h>

#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/messages/ros_messages.h"

/// ROS 2's serialization with Fast-CDR: numbers aligned to their size, in the byte order of the first bytes. A heavy
/// header: include it in .cpp files only.
namespace lodestone {

/// Reads one message. Every call throws ros1::MalformedMessage if the bytes end before. The constructor throws it if
/// the first four bytes are not those of plain CDR.
class CdrWireReader {
 public:
  CdrWireReader(const std::uint8_t* data, std::size_t size)
      : buffer_(const_cast<char*>(reinterpret_cast<const char*>(data)), size),
        cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR),
        end_(reinterpret_cast<const char*>(data) + size) {
    if (size < 4 || data[0] != 0 || data[1] > 1) {
      throw ros1::MalformedMessage(size < 4
                                       ? "the message is shorter than CDR's first four bytes"
                                       : "the message begins with the bytes " + std::to_string(int{data[0]}) + " " +
                                             std::to_string(int{data[1]}) + "; expected plain CDR (0 0 or 0 1)");
    }
    swapped_ = data[1] == 0;
    guard([&] { cdr_.read_encapsulation(); });
  }

  std::size_t left() { return static_cast<std::size_t>(end_ - cdr_.getCurrentPosition()); }
  bool swapped() const { return swapped_; }  ///< whether numbers are big-endian

  const std::uint8_t* bytes(std::size_t count) {
    const auto* at = reinterpret_cast<const std::uint8_t*>(cdr_.getCurrentPosition());
    if (count > left()) fail();
    if (count == 0) return at;
    cdr_.jump(count - 1);
    number<std::uint8_t>();  // Fast-CDR does not update its alignment after a jump alone
    return at;
  }
  template <class Number>
  Number number() {
    Number value{};
    guard([&] { cdr_.deserialize(value); });
    return value;
  }
  void text(std::string& value) {
    guard([&] { cdr_.deserialize(value); });
  }
  Time header(std::string& frame) {
    const auto seconds = number<std::int32_t>();
    const auto nanoseconds = number<std::uint32_t>();
    text(frame);
    return Time{seconds} * 1'000'000'000 + nanoseconds;
  }

 private:
  [[noreturn]] static void fail() { throw ros1::MalformedMessage("the message ends before the end of its content"); }
  template <class Call>
  static void guard(const Call& call) {
    try {
      call();
    } catch (const eprosima::fastcdr::exception::Exception&) {
      fail();
    }
  }

  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
  const char* end_;
  bool swapped_ = false;
};

/// Writes one message, little-endian.
class CdrWireWriter {
 public:
  CdrWireWriter() : cdr_(buffer_, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS, eprosima::fastcdr::Cdr::DDS_CDR) {
    cdr_.serialize_encapsulation();
  }
  void bytes(const std::uint8_t* data, std::size_t count) { cdr_.serializeArray(data, count); }
  template <class Number>
  void number(Number value) {
    pad(sizeof(Number));
    cdr_.serialize(value);
  }
  void text(const std::string& value) {
    pad(sizeof(std::uint32_t));  // of the length
    cdr_.serialize(value);
  }
  void header(Time stamp, const std::string& frame) {
    number(static_cast<std::int32_t>(stamp / 1'000'000'000));
    number(static_cast<std::uint32_t>(stamp % 1'000'000'000));
    text(frame);
  }
  std::vector<std::uint8_t> take() {
    const auto* data = reinterpret_cast<const std::uint8_t*>(buffer_.getBuffer());
    return {data, data + cdr_.getSerializedDataLength()};
  }

 private:
  /// Zeros up to a multiple of `size` after the first four bytes. Fast-CDR would skip them, and equal messages would
  /// have different bytes.
  void pad(std::size_t size) {
    while ((cdr_.getSerializedDataLength() - 4) % size != 0) cdr_.serialize(std::uint8_t{0});
  }

  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
};

}  // namespace lodestone
