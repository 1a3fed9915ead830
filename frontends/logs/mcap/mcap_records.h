#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/time.h"
#include "frontends/file_bytes.h"
#include "frontends/logs/compression.h"

/// The records of an MCAP file (mcap.dev/spec): one byte for the kind, eight for the length, then content. Numbers are
/// little-endian. Texts and lists follow their length in bytes.
namespace lodestone::mcap {

constexpr std::string_view magic("\x89MCAP0\r\n", 8);
constexpr std::size_t record_prefix = 9;  ///< bytes before a record's content

enum Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F
};

/// A record is inconsistent. The caller adds the file's name.
class RecordError : public std::runtime_error {
 public:
  explicit RecordError(const std::string& what) : std::runtime_error(what) {}
};

/// Reads a record's content field by field. Every call throws RecordError if the content ends before.
class RecordCursor {
 public:
  explicit RecordCursor(std::span<const std::uint8_t> content) : rest_(content) {}

  std::size_t left() const { return rest_.size(); }
  std::span<const std::uint8_t> bytes(std::uint64_t count) {
    if (count > rest_.size()) {
      throw RecordError("a record of the MCAP file ends " + std::to_string(count - rest_.size()) + " bytes too early");
    }
    const auto piece = rest_.first(static_cast<std::size_t>(count));
    rest_ = rest_.subspan(piece.size());
    return piece;
  }
  template <class Number>
  Number number() {
    return little_endian<Number>(bytes(sizeof(Number)).data());
  }
  /// Times are unsigned in the file. Times after the year 2262 are invalid; valid times are limited to `farthest_time`.
  Time time() {
    const auto value = number<std::uint64_t>();
    if (value > 0x7FFFFFFFFFFFFFFFULL) throw RecordError("an invalid time of " + std::to_string(value) + " ns");
    return std::min(static_cast<Time>(value), farthest_time);
  }
  std::string text() {
    const auto piece = bytes(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(piece.data()), piece.size()};
  }

 private:
  std::span<const std::uint8_t> rest_;
};

struct Schema {
  std::uint16_t id = 0;
  std::string name, encoding, data;
};

struct Channel {
  std::uint16_t id = 0, schema = 0;  ///< schema 0: none
  std::string topic, encoding;
  std::map<std::string, std::string> metadata;
};

struct MessageHeader {
  static constexpr std::size_t bytes = 22;
  std::uint16_t channel = 0;
  Time log_time = 0;
};

struct ChunkHeader {
  Time begin = 0, end = 0;
  std::uint64_t size = 0;  ///< bytes of the unpacked records
  std::uint32_t crc = 0;   ///< of the unpacked records; 0: none
  Codec codec = Codec::none;
  std::uint64_t records_offset = 0;  ///< of the packed records, from the content's begin
  std::uint64_t packed_size = 0;     ///< as announced in the header
};

Schema parse_schema(std::span<const std::uint8_t> content);
Channel parse_channel(std::span<const std::uint8_t> content);
MessageHeader parse_message_header(std::span<const std::uint8_t> content);

/// `content` may end after the fields before the packed records.
ChunkHeader parse_chunk_header(std::span<const std::uint8_t> content);

}  // namespace lodestone::mcap
