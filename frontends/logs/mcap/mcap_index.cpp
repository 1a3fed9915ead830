#include "frontends/logs/mcap/mcap_index.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "core/error.h"
#include "frontends/messages/topic_list.h"

namespace lodestone::mcap {
namespace {

constexpr std::uint64_t largest_chunk = 1ULL << 29;       // bytes, packed or not; usually about one megabyte
constexpr std::uint64_t largest_definition = 1ULL << 24;  // bytes of a schema or channel
constexpr std::uint64_t largest_index = 1ULL << 28;       // bytes of one chunk's index of one channel
constexpr std::uint64_t run_bytes = 4ULL << 20;    // size of a run of messages outside chunks that is loaded at once
constexpr std::uint64_t chunk_header_bytes = 128;  // enough for the fields before the packed records

}  // namespace

McapIndex::McapIndex(const std::string& path, WarningLog& warnings) : file_(path), warnings_(warnings) {
  file_.read(0, std::min<std::size_t>(magic.size(), file_.size()), buffer_);
  if (buffer_.size() < magic.size() ||
      !std::equal(magic.begin(), magic.end(), reinterpret_cast<const char*>(buffer_.data()))) {
    throw InputError(path + ": is not an MCAP file (it does not begin with the eight magic bytes)");
  }
  walk();
  name_topics();
  std::stable_sort(segments_.begin(), segments_.end(),
                   [](const Segment& a, const Segment& b) { return a.begin < b.begin; });
}

void McapIndex::walk() {
  std::uint64_t offset = magic.size();
  bool whole = false, in_chunk = false;
  while (!whole && file_.size() - offset >= record_prefix) {
    file_.read(offset, record_prefix, buffer_);
    const std::uint8_t opcode = buffer_[0];
    const auto size = little_endian<std::uint64_t>(buffer_.data() + 1);
    const std::uint64_t content = offset + record_prefix;
    const std::uint64_t there = file_.size() - content;
    if (opcode == 0) break;
    if (size > there && opcode != Opcode::chunk) break;
    try {
      process_record(opcode, content, std::min(size, there));
    } catch (const RecordError& error) {
      warnings_.add("log.damaged_record", fmt::format("{}: at byte {}: {}", path(), offset, error.what()), 0);
    }
    if (size > there) {
      if (open_chunk_) segments_.back().cut = in_chunk = true;
      break;
    }
    offset = content + size;
    whole = opcode == Opcode::footer;
  }
  if (!whole) chunk_counts_.clear();  // some indexes of the last chunk may be missing
  close_chunk();
  if (whole) return;
  const std::string what =
      fmt::format("{}: the file is cut off or damaged at byte {} of {}", path(), offset, file_.size());
  if (segments_.empty()) throw InputError(what + ", before the first message; record the log again");
  // A recorder without compression may write the whole log as one chunk.
  warnings_.add("log.cut_off",
                in_chunk ? fmt::format("{}: the file is cut off at byte {}, in the chunk that begins at byte {}; the "
                                       "complete messages before the cut are read",
                                       path(), file_.size(), offset)
                         : what + "; the messages before are read",
                segments_.back().end);
}

void McapIndex::process_record(std::uint8_t opcode, std::uint64_t offset, std::uint64_t size) {
  if (opcode != Opcode::message) open_run_ = false;
  if (opcode != Opcode::message_index) close_chunk();
  switch (opcode) {
    case Opcode::schema:
    case Opcode::channel:
      if (size > largest_definition) throw RecordError(fmt::format("a definition of {} bytes", size));
      file_.read(offset, size, buffer_);
      return define(opcode, buffer_);
    case Opcode::message:
      return process_message(offset - record_prefix, size);
    case Opcode::chunk: {
      file_.read(offset, static_cast<std::size_t>(std::min(size, chunk_header_bytes)), buffer_);
      const ChunkHeader header = parse_chunk_header(buffer_);
      segments_.push_back({offset, size, true, false, header.begin, header.end});
      open_chunk_ = true;
      return;
    }
    case Opcode::message_index:
      return process_message_index(offset, size);
    default:
      return;  // attachments, metadata, the summary's indexes, private records
  }
}

/// A message outside chunks.
void McapIndex::process_message(std::uint64_t record, std::uint64_t size) {
  if (size < MessageHeader::bytes || size > largest_chunk)
    throw RecordError(fmt::format("a message of {} bytes", size));
  file_.read(record + record_prefix, MessageHeader::bytes, buffer_);
  const MessageHeader header = parse_message_header(buffer_);
  counts_[header.channel].add(header.log_time);
  if (!open_run_ || segments_.back().size + record_prefix + size > run_bytes) {
    segments_.push_back({record, 0, false, false, header.log_time, header.log_time});
    open_run_ = true;
  }
  Segment& segment = segments_.back();
  segment.size += record_prefix + size;
  segment.begin = std::min(segment.begin, header.log_time);
  segment.end = std::max(segment.end, header.log_time);
}

void McapIndex::process_message_index(std::uint64_t offset, std::uint64_t size) {
  if (!open_chunk_) return;
  if (size > largest_index) throw RecordError(fmt::format("a message index of {} bytes", size));
  file_.read(offset, size, buffer_);
  RecordCursor cursor(buffer_);
  MessageCount& count = chunk_counts_[cursor.number<std::uint16_t>()];
  RecordCursor entries(cursor.bytes(cursor.number<std::uint32_t>()));
  while (entries.left() > 0) {
    count.add(entries.time());
    entries.number<std::uint64_t>();  // offset in the chunk; read again when the chunk is loaded
  }
}

/// Called after all indexes of the last chunk: sets its begin and counts its messages. A chunk without indexes, or with
/// messages of an undefined channel, is unpacked instead.
void McapIndex::close_chunk() {
  if (!open_chunk_) return;
  open_chunk_ = false;
  Segment& segment = segments_.back();
  const bool known = std::all_of(chunk_counts_.begin(), chunk_counts_.end(),
                                 [this](const auto& entry) { return channels_.count(entry.first) > 0; });
  if (chunk_counts_.empty() || !known || segment.cut) {
    LoadedSegment loaded;
    load(segment, loaded);
    chunk_counts_.clear();
    for (const SegmentEntry& entry : loaded.entries) chunk_counts_[entry.channel].add(entry.time);
  }
  MessageCount all;
  for (const auto& [channel, count] : chunk_counts_) {
    counts_[channel].add(count);
    all.add(count);
  }
  chunk_counts_.clear();
  if (all.messages == 0) {
    segments_.pop_back();
    return;
  }
  segment.begin = all.begin;
  segment.end = all.end;
}

void McapIndex::define(std::uint8_t opcode, std::span<const std::uint8_t> content) {
  if (opcode == Opcode::schema) {
    Schema schema = parse_schema(content);
    schemas_.try_emplace(schema.id, std::move(schema));
  } else {
    Channel channel = parse_channel(content);
    channels_.try_emplace(channel.id, std::move(channel));
  }
}

void McapIndex::name_topics() {
  std::map<std::uint32_t, TopicInfo> infos;
  for (const auto& [id, channel] : channels_) {
    TopicInfo& info = infos[id];
    info.name = channel.topic;
    info.encoding = parse_encoding(channel.encoding);
    if (info.encoding == Encoding::cdr) info.metadata = channel.metadata;
    const auto schema = schemas_.find(channel.schema);
    if (schema == schemas_.end()) continue;
    info.type = ros1_type_name(schema->second.name);
    info.definition = schema->second.data;
    info.definition_encoding = schema->second.encoding;
  }
  topics_ = collect_topics(path(), infos, counts_, warnings_);
}

void McapIndex::report_loss(const Segment& segment, const std::string& what) {
  if (!lost_.insert(segment.offset).second) return;
  warnings_.add(
      "log.damaged_chunk",
      fmt::format("{}: the chunk at byte {}: {}; its messages from there on are lost", path(), segment.offset, what),
      segment.begin);
}

void McapIndex::load(const Segment& segment, LoadedSegment& loaded) {
  loaded.bytes.clear();
  loaded.entries.clear();
  try {
    read_segment(segment, loaded);
    collect_entries(loaded);
  } catch (const CompressionError& error) {
    report_loss(segment, error.what());
  } catch (const RecordError& error) {
    if (!segment.cut) report_loss(segment, error.what());
  }
  std::stable_sort(loaded.entries.begin(), loaded.entries.end(),
                   [](const SegmentEntry& a, const SegmentEntry& b) { return a.time < b.time; });
}

void McapIndex::read_segment(const Segment& segment, LoadedSegment& loaded) {
  if (segment.size > largest_chunk) throw RecordError(fmt::format("a chunk of {} bytes", segment.size));
  if (!segment.chunk) return file_.read(segment.offset, static_cast<std::size_t>(segment.size), loaded.bytes);
  file_.read(segment.offset, static_cast<std::size_t>(segment.size), buffer_);
  const ChunkHeader header = parse_chunk_header(buffer_);
  RecordCursor cursor(std::span<const std::uint8_t>(buffer_).subspan(header.records_offset));
  const auto packed =
      cursor.bytes(segment.cut ? std::min<std::uint64_t>(header.packed_size, cursor.left()) : header.packed_size);
  if (header.size > largest_chunk) throw RecordError(fmt::format("a chunk that unpacks to {} bytes", header.size));
  unpack(header.codec, packed, header.size, segment.cut ? UnpackedSize::cut_off : UnpackedSize::exact, loaded.bytes);
  if (segment.cut || header.crc == 0) return;
  const auto crc = ::crc32_z(0, loaded.bytes.data(), loaded.bytes.size());
  if (crc != header.crc) throw RecordError("its checksum differs");
}

void McapIndex::collect_entries(LoadedSegment& loaded) {
  const std::span<const std::uint8_t> all(loaded.bytes);
  RecordCursor cursor(all);
  while (cursor.left() > 0) {
    const auto opcode = cursor.number<std::uint8_t>();
    const auto content = cursor.bytes(cursor.number<std::uint64_t>());
    if (opcode == Opcode::message) {
      const MessageHeader header = parse_message_header(content);
      const auto offset = static_cast<std::size_t>(content.data() - all.data()) + MessageHeader::bytes;
      loaded.entries.push_back({header.log_time, header.channel, offset, content.size() - MessageHeader::bytes});
    } else if (opcode == Opcode::schema || opcode == Opcode::channel) {
      define(opcode, content);
    }
  }
}

}  // namespace lodestone::mcap
