#include "frontends/logs/rosbag/cut_bag.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "frontends/logs/compression.h"

namespace lodestone {
namespace {

constexpr std::uint64_t magic_bytes = 13;

/// Seconds in the lower half, nanoseconds in the upper one.
Time time_of(std::uint64_t value) {
  return static_cast<Time>(value & 0xFFFFFFFFU) * 1'000'000'000 + static_cast<Time>(value >> 32U);
}

}  // namespace

CutBag::CutBag(const std::string& path, WarningLog& warnings) : file_(path), warnings_(warnings) {
  const std::uint64_t cut = walk();
  const std::string what = fmt::format("{}: the bag is cut off at byte {} of {}, or was not closed by its recorder", path, cut,
                                       file_.size());
  if (chunks_.empty()) throw InputError(what + "; there is no message ahead of that; record it again");
  std::stable_sort(chunks_.begin(), chunks_.end(), [](const Chunk& a, const Chunk& b) { return a.begin < b.begin; });
  topics_ = collect_topics(path, connections_, counts_, warnings_);
  warnings_.add("log.cut_off", what + "; what lies before is read", chunks_.back().end);
}

/// The first byte that could not be read.
std::uint64_t CutBag::walk() {
  std::uint64_t offset = magic_bytes;
  try {
    while (offset < file_.size()) offset = take_record(offset);
  } catch (const BagRecordError&) {
    // Here it ends.
  }
  if (offset < file_.size()) chunk_counts_.clear();  // some of the last chunk's indexes may be missing
  close_chunk();
  return offset;
}

/// Returns where the next one starts.
std::uint64_t CutBag::take_record(std::uint64_t offset) {
  const auto piece = [this](std::uint64_t at) -> std::uint64_t {
    if (file_.size() - at < 4) throw BagRecordError("the file ends within a record");
    std::uint8_t bytes[4];
    file_.read(at, bytes);
    return little_endian<std::uint32_t>(bytes);
  };
  const std::uint64_t header_size = piece(offset);
  if (header_size > largest_bag_header || header_size > file_.size() - offset - 4) throw BagRecordError("a header that is not whole");
  file_.read(offset + 4, static_cast<std::size_t>(header_size), header_);
  const BagHeader header(header_);
  const BagOperation operation = header.operation();
  const std::uint64_t data = offset + 8 + header_size;
  const std::uint64_t size = piece(offset + 4 + header_size);
  const std::uint64_t there = file_.size() - data;
  if (operation != BagOperation::index) close_chunk();
  if (operation == BagOperation::chunk) {
    // A recorder writes the chunk's sizes when the chunk is full: until then they are zero, and the content goes on to the end.
    const bool unfinished = size == 0;
    take_chunk(header, data, unfinished ? there : size);
    if (unfinished || size > there) throw BagRecordError("a chunk that is not whole");
    return data + size;
  }
  if (size > there) throw BagRecordError("a record that is not whole");
  if (operation == BagOperation::index) {
    take_index(header, data, size);
  } else if (operation == BagOperation::connection) {
    if (size > largest_bag_header) throw BagRecordError("a connection that is too long");
    file_.read(data, static_cast<std::size_t>(size), buffer_);
    define(header, buffer_);
  } else if (operation != BagOperation::file_header && operation != BagOperation::chunk_info) {
    throw BagRecordError("a record of a kind that does not belong there");
  }
  return data + size;
}

void CutBag::take_chunk(const BagHeader& header, std::uint64_t data, std::uint64_t size) {
  Chunk chunk;
  chunk.data = data;
  chunk.cut = size >= file_.size() - data;
  chunk.packed = std::min(size, file_.size() - data);
  chunk.size = header.number<std::uint32_t>("size");
  chunk.compression = header.text("compression");
  bag_codec(chunk.compression);
  if (chunk.cut && chunk.size == 0) chunk.size = largest_bag_chunk;
  if (chunk.size > largest_bag_chunk || chunk.packed > largest_bag_chunk) throw BagRecordError("a chunk that is too large");
  chunks_.push_back(std::move(chunk));
  open_chunk_ = true;
}

void CutBag::take_index(const BagHeader& header, std::uint64_t data, std::uint64_t size) {
  const auto count = header.number<std::uint32_t>("count");
  if (!open_chunk_ || count * bag_index_entry_bytes != size) throw BagRecordError("an index that does not fit");
  file_.read(data, static_cast<std::size_t>(size), buffer_);
  MessageCount& messages = chunk_counts_[header.number<std::uint32_t>("conn")];
  for (std::size_t i = 0; i < count; ++i) {
    messages.add(time_of(little_endian<std::uint64_t>(buffer_.data() + i * bag_index_entry_bytes)));
  }
}

void CutBag::define(const BagHeader& header, std::span<const std::uint8_t> content) {
  const BagHeader description(content);
  TopicInfo info;
  info.name = header.text("topic");
  info.type = description.text("type");
  info.md5 = description.text("md5sum");
  info.definition = description.text("message_definition");
  const auto connection = header.number<std::uint32_t>("conn");
  if (!connections_.try_emplace(connection, std::move(info)).second) return;
  if (!description.has("callerid") && !description.has("latching")) return;
  publishers_[connection] = {description.has("callerid") ? description.text("callerid") : std::string(),
                             description.has("latching") && description.value("latching") == "1"};
}

/// The last chunk's indexes have all been read: they count its messages, and say when it begins. A chunk without them, or
/// with messages of a connection that nothing has described yet, is unpacked instead.
void CutBag::close_chunk() {
  if (!open_chunk_) return;
  open_chunk_ = false;
  Chunk& chunk = chunks_.back();
  const bool known = std::all_of(chunk_counts_.begin(), chunk_counts_.end(),
                                 [this](const auto& entry) { return connections_.count(entry.first) > 0; });
  if (chunk_counts_.empty() || !known || chunk.cut) {
    LoadedSegment loaded;
    load(chunk, loaded);
    chunk_counts_.clear();
    for (const SegmentEntry& entry : loaded.entries) chunk_counts_[entry.channel].add(entry.time);
  }
  MessageCount all;
  for (const auto& [connection, count] : chunk_counts_) {
    counts_[connection].add(count);
    all.add(count);
  }
  chunk_counts_.clear();
  if (all.messages == 0) {
    chunks_.pop_back();
    return;
  }
  chunk.begin = all.begin;
  chunk.end = all.end;
}

int CutBag::topic_of(std::uint32_t channel) const {
  const auto found = topics_.topic_of.find(channel);
  return found == topics_.topic_of.end() ? -1 : found->second;
}

const Publisher* CutBag::publisher_of(std::uint32_t channel) const {
  const auto found = publishers_.find(channel);
  return found == publishers_.end() ? nullptr : &found->second;
}

void CutBag::load(const Chunk& chunk, LoadedSegment& loaded) {
  loaded.bytes.clear();
  loaded.entries.clear();
  const auto lose = [&](const char* what) {
    if (chunk.cut || !lost_.insert(chunk.data).second) return;
    warnings_.add("log.damaged_chunk",
                  fmt::format("{}: the chunk at byte {}: {}; its messages from there on are left out", path(), chunk.data, what),
                  chunk.begin);
  };
  try {
    file_.read(chunk.data, static_cast<std::size_t>(chunk.packed), buffer_);
    unpack(bag_codec(chunk.compression), buffer_, chunk.size, chunk.cut ? UnpackedSize::cut_off : UnpackedSize::exact,
           loaded.bytes);
    take_entries(loaded);
  } catch (const CompressionError& error) {
    lose(error.what());
  } catch (const BagRecordError& error) {
    lose(error.what());
  }
  std::stable_sort(loaded.entries.begin(), loaded.entries.end(),
                   [](const SegmentEntry& a, const SegmentEntry& b) { return a.time < b.time; });
}

void CutBag::take_entries(LoadedSegment& loaded) {
  const std::span<const std::uint8_t> all(loaded.bytes);
  for (std::size_t offset = 0; offset < all.size();) {
    const BagRecordView record = view_record(all, offset);
    const BagHeader header(record.header);
    const std::size_t data = offset + 8 + record.header.size();
    if (header.operation() == BagOperation::message) {
      loaded.entries.push_back({time_of(header.number<std::uint64_t>("time")), header.number<std::uint32_t>("conn"), data,
                                record.end - data});
    } else if (header.operation() == BagOperation::connection) {
      define(header, all.subspan(data, record.end - data));
    }
    offset = record.end;
  }
}

}  // namespace lodestone
