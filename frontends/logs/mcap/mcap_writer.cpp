#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <map>

#include "core/error.h"
#include "frontends/configuration/output_file.h"
#include "frontends/logs/log_writer.h"
#include "frontends/logs/mcap/mcap_records.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {
namespace {

constexpr std::size_t chunk_bytes = 1 << 20;

/// The content of one or several records, under construction.
class Content {
 public:
  template <class Number>
  Content& number(Number value) {
    std::array<std::uint8_t, sizeof(Number)> raw_number;
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      raw_number[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
    }
    return raw(raw_number);
  }
  Content& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  Content& raw(std::span<const std::uint8_t> value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + value.size());
    std::copy(value.begin(), value.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(at));
    return *this;
  }
  Content& record(std::uint8_t opcode, const Content& content) {
    return number(opcode).number(std::uint64_t{content.bytes_.size()}).raw(content.bytes_);
  }
  std::size_t size() const { return bytes_.size(); }
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::uint8_t> bytes_;
};

struct IndexEntry {
  std::uint64_t time, offset;
};

struct WrittenChannel {
  std::uint16_t id = 0;
  std::uint64_t messages = 0;
  std::vector<IndexEntry> index;  ///< of the messages in the open chunk
};

/// Chunks of about one megabyte with indexes, a summary, checksums.
struct McapWriter final : LogWriter {
  McapWriter(const std::string& path_in, Codec codec_in) : path(path_in), file(path_in), codec(codec_in) {
    put_magic();
    put(mcap::Opcode::header, Content().text("ros2").text("lodestone"));
  }
  Encoding encoding() const override { return Encoding::cdr; }
  void write(const TopicInfo& topic, const RawMessage& message) override;
  void close() override;

  std::string path;
  OutputFile file;
  Codec codec;
  std::uint64_t offset = 0;
  Content chunk;
  std::uint64_t chunk_begin = 0, chunk_end = 0, begin = 0, end = 0, messages = 0;
  std::map<std::string, std::uint16_t> schemas;  ///< by type
  std::map<std::string, WrittenChannel> channels;
  Content definitions;  ///< all schemas and channels, for the summary
  Content chunk_indexes;
  std::uint32_t chunks = 0;

  void put(std::span<const std::uint8_t> bytes) {
    file.write(bytes);
    offset += bytes.size();
  }
  void put(std::uint8_t opcode, const Content& content) {
    Content record;
    record.record(opcode, content);
    put(record.bytes());
  }
  void put_magic() { put({reinterpret_cast<const std::uint8_t*>(mcap::magic.data()), mcap::magic.size()}); }
  WrittenChannel& channel_of(const TopicInfo& topic);
  void end_chunk();
  void put_summary();
};

WrittenChannel& McapWriter::channel_of(const TopicInfo& topic) {
  const auto [entry, is_new] = channels.try_emplace(topic.name);
  WrittenChannel& channel = entry->second;
  if (!is_new) return channel;
  const auto define = [this](std::uint8_t opcode, const Content& content) {
    chunk.record(opcode, content);
    definitions.record(opcode, content);
  };
  const auto [schema, is_new_type] = schemas.try_emplace(topic.type, static_cast<std::uint16_t>(schemas.size() + 1));
  if (is_new_type) {
    const TypeDefinition definition = ros2_definition(topic);
    define(mcap::Opcode::schema, Content()
                                     .number(schema->second)
                                     .text(ros2_type_name(topic.type))
                                     .text(definition.encoding)
                                     .text(definition.text));
  }
  channel.id = static_cast<std::uint16_t>(channels.size() - 1);
  Content metadata;
  for (const auto& [key, value] : topic.metadata) metadata.text(key).text(value);
  define(mcap::Opcode::channel, Content()
                                    .number(channel.id)
                                    .number(schema->second)
                                    .text(topic.name)
                                    .text("cdr")
                                    .number(static_cast<std::uint32_t>(metadata.size()))
                                    .raw(metadata.bytes()));
  return channel;
}

void McapWriter::end_chunk() {
  if (chunk.size() == 0) return;
  const std::vector<std::uint8_t> packed = pack(codec, chunk.bytes());
  const char* name = codec == Codec::lz4 ? "lz4" : codec == Codec::zstd ? "zstd" : "";
  const std::uint64_t start = offset;
  const auto crc = static_cast<std::uint32_t>(::crc32_z(0, chunk.bytes().data(), chunk.size()));
  Content content;
  content.number(chunk_begin).number(chunk_end).number(std::uint64_t{chunk.size()}).number(crc).text(name);
  put(mcap::Opcode::chunk, content.number(std::uint64_t{packed.size()}).raw(packed));
  const std::uint64_t after_chunk = offset;
  Content index_offsets;
  for (auto& [topic, channel] : channels) {
    if (channel.index.empty()) continue;
    index_offsets.number(channel.id).number(offset);
    Content index;
    index.number(channel.id).number(static_cast<std::uint32_t>(channel.index.size() * 16));
    for (const IndexEntry& entry : channel.index) index.number(entry.time).number(entry.offset);
    put(mcap::Opcode::message_index, index);
    channel.index.clear();
  }
  Content summary;
  summary.number(chunk_begin).number(chunk_end).number(start).number(after_chunk - start);
  summary.number(static_cast<std::uint32_t>(index_offsets.size()))
      .raw(index_offsets.bytes())
      .number(offset - after_chunk);
  summary.text(name).number(std::uint64_t{packed.size()}).number(std::uint64_t{chunk.size()});
  chunk_indexes.record(mcap::Opcode::chunk_index, summary);
  ++chunks;
  chunk.clear();
}

void McapWriter::put_summary() {
  put(mcap::Opcode::data_end, Content().number(std::uint32_t{0}));
  const std::uint64_t summary = offset;
  put(definitions.bytes());
  Content statistics;
  statistics.number(messages).number(static_cast<std::uint16_t>(schemas.size()));
  statistics.number(static_cast<std::uint32_t>(channels.size())).number(std::uint32_t{0}).number(std::uint32_t{0});
  statistics.number(chunks).number(begin).number(end).number(static_cast<std::uint32_t>(channels.size() * 10));
  for (const auto& [topic, channel] : channels) statistics.number(channel.id).number(channel.messages);
  put(mcap::Opcode::statistics, statistics);
  put(chunk_indexes.bytes());
  put(mcap::Opcode::footer, Content().number(summary).number(std::uint64_t{0}).number(std::uint32_t{0}));
}

void McapWriter::write(const TopicInfo& topic, const RawMessage& message) {
  if (message.record_time < 0) {
    throw InputError(fmt::format("{}: a record time of {} ns cannot be written", path, message.record_time));
  }
  const auto time = static_cast<std::uint64_t>(message.record_time);
  const bool new_chunk = chunk.size() == 0;
  WrittenChannel& channel = channel_of(topic);
  channel.index.push_back({time, chunk.size()});
  // Prefix, channel, sequence, log and publish time, payload. Written directly, without a copy of the payload.
  chunk.number(std::uint8_t{mcap::Opcode::message}).number(std::uint64_t{mcap::MessageHeader::bytes + message.size});
  chunk.number(channel.id).number(static_cast<std::uint32_t>(channel.messages)).number(time).number(time);
  chunk.raw({message.data, message.size});
  chunk_begin = new_chunk ? time : std::min(chunk_begin, time);
  chunk_end = new_chunk ? time : std::max(chunk_end, time);
  begin = messages == 0 ? time : std::min(begin, time);
  end = std::max(end, time);
  ++messages;
  ++channel.messages;
  if (chunk.size() >= chunk_bytes) end_chunk();
}

void McapWriter::close() {
  end_chunk();
  put_summary();
  put_magic();
  file.commit();
}

}  // namespace

std::unique_ptr<LogWriter> make_mcap_writer(const std::string& path, Codec codec) {
  return std::make_unique<McapWriter>(path, codec);
}

}  // namespace lodestone
