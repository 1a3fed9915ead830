#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/exceptions/Exception.h>

#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/logs/ros1/messages.h"

/// ROS 2's serialization through Fast-CDR: numbers at multiples of their size, in the byte order that the first bytes
/// say. Heavy: for .cpp files only.
namespace lodestone {

/// Reads one message. Every call throws ros1::MalformedMessage where the bytes end before; so does the constructor
/// where the first four bytes announce another kind of CDR than the plain one that ROS 2 writes.
class CdrWireReader {
 public:
  CdrWireReader(const std::uint8_t* data, std::size_t size)
      : buffer_(const_cast<char*>(reinterpret_cast<const char*>(data)), size),
        cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR),
        end_(reinterpret_cast<const char*>(data) + size) {
    if (size < 4 || data[0] != 0 || data[1] > 1) {
      throw ros1::MalformedMessage(size < 4
                                       ? "the message is shorter than CDR's first four bytes"
                                       : "the message starts with the bytes " + std::to_string(int{data[0]}) + " " +
                                             std::to_string(int{data[1]}) + "; expected plain CDR (0 0 or 0 1)");
    }
    swapped_ = data[1] == 0;
    guard([&] { cdr_.read_encapsulation(); });
  }

  std::size_t left() { return static_cast<std::size_t>(end_ - cdr_.getCurrentPosition()); }
  bool swapped() const { return swapped_; }  ///< whether numbers lie big-endian

  const std::uint8_t* bytes(std::size_t count) {
    const auto* at = reinterpret_cast<const std::uint8_t*>(cdr_.getCurrentPosition());
    if (count > left()) fail();
    if (count == 0) return at;
    cdr_.jump(count - 1);
    number<std::uint8_t>();  // a jump alone would let Fast-CDR believe that it still stands where the last number ended
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
  [[noreturn]] static void fail() { throw ros1::MalformedMessage("the message ends before its content does"); }
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
    cdr_.serialize(value);
  }
  void text(const std::string& value) { cdr_.serialize(value); }
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
  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
};

}  // namespace lodestone
