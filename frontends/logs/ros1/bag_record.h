#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "frontends/file_bytes.h"
#include "frontends/logs/compression.h"

/// The records of a ROS 1 bag: a header of named fields, then content; each follows its length.
namespace lodestone {

/// A record is inconsistent. The caller adds the file's name.
class BagRecordError : public std::runtime_error {
 public:
  explicit BagRecordError(const std::string& what) : std::runtime_error(what) {}
};

constexpr std::uint32_t largest_bag_header = 1U << 24;  // a connection's header contains the definition of its message
constexpr std::uint32_t largest_bag_chunk = 1U << 30;
constexpr std::size_t bag_index_entry_bytes = 12;  // seconds, nanoseconds, offset in the chunk

/// Codec by its name in a chunk's header.
inline Codec bag_codec(const std::string& name) {
  if (name == "none") return Codec::none;
  if (name == "lz4") return Codec::lz4;
  if (name == "bz2") return Codec::bz2;
  throw BagRecordError("the compression '" + name + "' is unknown; expected none, lz4 or bz2");
}

enum class BagOperation : std::uint8_t {
  message = 2,
  file_header = 3,
  index = 4,
  chunk = 5,
  chunk_info = 6,
  connection = 7
};

/// The fields of a header. Views of bytes that must outlive this.
class BagHeader {
 public:
  BagHeader() = default;
  explicit BagHeader(std::span<const std::uint8_t> bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
      if (bytes.size() - at < 4) throw BagRecordError("a header ends within a field");
      const auto size = little_endian<std::uint32_t>(bytes.data() + at);
      at += 4;
      if (size > bytes.size() - at) throw BagRecordError("a header's field is longer than the header");
      const std::string_view field(reinterpret_cast<const char*>(bytes.data()) + at, size);
      const std::size_t equals = field.find('=');
      if (equals == std::string_view::npos) throw BagRecordError("a header's field has no '='");
      fields_.push_back({field.substr(0, equals), field.substr(equals + 1)});
      at += size;
    }
  }

  std::string_view value(std::string_view name) const {
    for (const Field& field : fields_) {
      if (field.name == name) return field.value;
    }
    throw BagRecordError("a header has no field '" + std::string(name) + "'");
  }
  bool has(std::string_view name) const {
    return std::any_of(fields_.begin(), fields_.end(), [name](const Field& field) { return field.name == name; });
  }
  std::string text(std::string_view name) const { return std::string(value(name)); }
  template <class Number>
  Number number(std::string_view name) const {
    const std::string_view bytes = value(name);
    if (bytes.size() != sizeof(Number)) throw BagRecordError("the field '" + std::string(name) + "' has another size");
    return little_endian<Number>(reinterpret_cast<const std::uint8_t*>(bytes.data()));
  }
  BagOperation operation() const { return static_cast<BagOperation>(number<std::uint8_t>("op")); }

 private:
  struct Field {
    std::string_view name, value;
  };
  std::vector<Field> fields_;
};

/// A record within a chunk.
struct BagRecordView {
  std::span<const std::uint8_t> header;
  std::size_t end = 0;  ///< offset of the next record
};

inline BagRecordView view_record(std::span<const std::uint8_t> chunk, std::size_t offset) {
  const auto piece = [&chunk](std::size_t at) {
    if (chunk.size() - at < 4) throw BagRecordError("a chunk ends within a record");
    const auto size = little_endian<std::uint32_t>(chunk.data() + at);
    if (size > chunk.size() - at - 4) throw BagRecordError("a record in a chunk is longer than the chunk");
    return chunk.subspan(at + 4, size);
  };
  const std::span<const std::uint8_t> header = piece(offset);
  const std::size_t data = offset + 4 + header.size();
  return {header, data + 4 + piece(data).size()};
}

}  // namespace lodestone
