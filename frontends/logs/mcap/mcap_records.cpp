#include "frontends/logs/mcap/mcap_records.h"

namespace lodestone::mcap {

Schema parse_schema(std::span<const std::uint8_t> content) {
  RecordCursor cursor(content);
  Schema result;
  result.id = cursor.number<std::uint16_t>();
  result.name = cursor.text();
  result.encoding = cursor.text();
  result.data = cursor.text();
  if (result.id == 0) throw RecordError("a schema has the id 0");
  return result;
}

Channel parse_channel(std::span<const std::uint8_t> content) {
  RecordCursor cursor(content);
  Channel result;
  result.id = cursor.number<std::uint16_t>();
  result.schema = cursor.number<std::uint16_t>();
  result.topic = cursor.text();
  result.encoding = cursor.text();
  try {
    RecordCursor pairs(cursor.bytes(cursor.number<std::uint32_t>()));
    while (pairs.left() > 0) {
      const std::string key = pairs.text();
      result.metadata.try_emplace(key, pairs.text());
    }
  } catch (const RecordError&) {
    // Messages do not require metadata; damaged metadata is kept as far as readable.
  }
  return result;
}

MessageHeader parse_message_header(std::span<const std::uint8_t> content) {
  RecordCursor cursor(content);
  MessageHeader result;
  result.channel = cursor.number<std::uint16_t>();
  cursor.number<std::uint32_t>();  // sequence
  result.log_time = cursor.time();
  cursor.number<std::uint64_t>();  // publish time
  return result;
}

ChunkHeader parse_chunk_header(std::span<const std::uint8_t> content) {
  RecordCursor cursor(content);
  ChunkHeader result;
  result.begin = cursor.time();
  result.end = cursor.time();
  result.size = cursor.number<std::uint64_t>();
  result.crc = cursor.number<std::uint32_t>();
  const std::string compression = cursor.text();
  if (compression == "lz4") {
    result.codec = Codec::lz4;
  } else if (compression == "zstd") {
    result.codec = Codec::zstd;
  } else if (!compression.empty()) {
    throw RecordError("the compression '" + compression + "' is unknown; expected none, lz4 or zstd");
  }
  result.packed_size = cursor.number<std::uint64_t>();
  result.records_offset = content.size() - cursor.left();
  return result;
}

}  // namespace lodestone::mcap
