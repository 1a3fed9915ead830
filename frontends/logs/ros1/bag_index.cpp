#include "frontends/logs/ros1/bag_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "frontends/logs/compression.h"

namespace lodestone {
namespace {

constexpr std::string_view magic = "#ROSBAG V2.0\n";

/// The file ends within a record, or before the index that its first record announces.
struct BagEnd {};

/// Seconds in the lower half, nanoseconds in the upper half.
Time time_of(std::uint64_t value) {
  return static_cast<Time>(value & 0xFFFFFFFFU) * 1'000'000'000 + static_cast<Time>(value >> 32U);
}

}  // namespace

void BagIndex::fail(std::uint64_t byte, const std::string& what) const {
  throw InputError(
      fmt::format("{}: the bag is damaged at byte {}: {}; repair it with 'rosbag reindex', or record the log again",
                  path(), byte, what));
}

void BagIndex::check_magic() const {
  std::vector<std::uint8_t> start;
  file_.read(0, static_cast<std::size_t>(std::min<std::uint64_t>(magic.size(), file_.size())), start);
  const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  if (!text.starts_with("#ROSBAG V"))
    throw InputError(path() + ": is not a ROS 1 bag (it does not begin with '#ROSBAG V')");
  if (text.size() == magic.size() && text != magic) {
    throw InputError(path() +
                     ": is a ROS 1 bag of another version than 2.0; convert it with 'rosbag fix' of ROS Noetic");
  }
}

BagIndex::BagIndex(const std::string& path, WarningLog& warnings) : file_(path), warnings_(warnings) {
  check_magic();
  std::uint64_t end = std::min<std::uint64_t>(magic.size(), file_.size());
  cut_ = !walk(end);
  if (cut_ && end < file_.size()) chunk_counts_.clear();  // some of the last chunk's indexes may be missing
  close_chunk();
  const std::string what = fmt::format("{}: the bag is cut off at byte {} of {}, or was not closed by its recorder",
                                       path, end, file_.size());
  if (cut_ && chunks_.empty()) throw InputError(what + "; there is no message before; record the log again");
  if (damaged_ && chunks_.empty()) fail(end, "there is no message that can be read");
  std::stable_sort(chunks_.begin(), chunks_.end(),
                   [](const Chunk& a, const Chunk& b) { return a.count.begin < b.count.begin; });
  topics_ = collect_topics(path, connections_, counts_, warnings_);
  if (cut_) warnings_.add("log.cut_off", what + "; the messages before are read", chunks_.back().count.end);
}

/// False if the bag is cut off or was not closed. `offset` ends at the first unread byte.
bool BagIndex::walk(std::uint64_t& offset) {
  while (offset < file_.size()) {
    std::string wrong = "a record ends behind the end of the file";
    bool ends = true;
    try {
      offset = process_record(offset);
      continue;
    } catch (const BagEnd&) {
    } catch (const BagRecordError& error) {
      if (offset == magic.size()) fail(offset, error.what());
      wrong = error.what();
      ends = false;
    }
    const std::uint64_t index_start = announced_.index_start;
    if (index_start == 0 || index_start > file_.size() || (ends && offset >= index_start)) return false;
    damaged_ = true;
    chunk_counts_.clear();  // some of the chunk's indexes cannot be read
    close_chunk();
    warnings_.add(
        "log.damaged_record",
        fmt::format("{}: the record at byte {}: {}; the chunks that the index states are read", path(), offset, wrong),
        chunks_.empty() ? 0 : chunks_.back().count.end);
    if (offset >= index_start || stated_.empty()) return true;
    offset = next_stated(offset);
  }
  return damaged_ || (announced_.index_start != 0 && announced_.index_start <= file_.size() &&
                      indexed_connections_ >= announced_.connections && indexed_chunks_ >= announced_.chunks);
}

/// As far as the index at the end of the file can be read.
void BagIndex::read_stated_chunks() {
  try {
    for (std::uint64_t at = announced_.index_start; at < file_.size();) {
      const Content content = read_header(at);
      if (header_.empty()) break;
      at = content.data + content.size;
      try {
        const BagHeader header(header_);
        if (header.operation() == BagOperation::chunk_info)
          stated_.push_back(header.number<std::uint64_t>("chunk_pos"));
      } catch (const BagRecordError&) {
        // The length of the record is known: the next one may be whole.
      }
    }
  } catch (const BagEnd&) {
  } catch (const BagRecordError&) {
  }
  std::vector<std::uint64_t> places = std::exchange(stated_, {});
  std::erase_if(places, [&](std::uint64_t place) { return place >= announced_.index_start || !is_chunk(place); });
  std::sort(places.begin(), places.end());
  stated_ = std::move(places);
}

/// Whether a chunk begins there: the index may be altered, too.
bool BagIndex::is_chunk(std::uint64_t place) {
  constexpr std::uint32_t kLargestHeader = 4096;
  std::uint8_t bytes[4];
  if (file_.size() - place < sizeof(bytes)) return false;
  file_.read(place, bytes);
  if (little_endian<std::uint32_t>(bytes) > kLargestHeader) return false;
  try {
    read_header(place);
    return BagHeader(header_).operation() == BagOperation::chunk;
  } catch (const BagEnd&) {
  } catch (const BagRecordError&) {
  }
  return false;
}

/// The next chunk that the index states, or the index itself.
std::uint64_t BagIndex::next_stated(std::uint64_t offset) const {
  const auto next = std::upper_bound(stated_.begin(), stated_.end(), offset);
  return next == stated_.end() ? announced_.index_start : *next;
}

/// Of the record at `offset`. Its header is in header_.
BagIndex::Content BagIndex::read_header(std::uint64_t offset) {
  const auto piece = [this](std::uint64_t at) -> std::uint64_t {
    if (at > file_.size() || file_.size() - at < 4) throw BagEnd();
    std::uint8_t bytes[4];
    file_.read(at, bytes);
    return little_endian<std::uint32_t>(bytes);
  };
  const std::uint64_t header_size = piece(offset);
  if (header_size > largest_bag_header) throw BagRecordError(fmt::format("a record's header of {} bytes", header_size));
  const std::uint64_t size = piece(offset + 4 + header_size);
  // An altered length must not hide the chunks behind it.
  if (!stated_.empty() && offset < announced_.index_start && offset + 8 + header_size + size > next_stated(offset)) {
    throw BagRecordError(fmt::format("a record of {} bytes, beyond the next chunk", header_size + size));
  }
  file_.read(offset + 4, static_cast<std::size_t>(header_size), header_);
  return {offset + 8 + header_size, size};
}

/// Returns the offset of the next record.
std::uint64_t BagIndex::process_record(std::uint64_t offset) {
  const auto [data, size] = read_header(offset);
  const std::uint64_t there = file_.size() - data;
  const BagHeader header(header_);
  const BagOperation operation = header.operation();
  if ((offset == magic.size()) != (operation == BagOperation::file_header)) {
    throw BagRecordError(offset == magic.size() ? "the first record is not a file header"
                                                : "there is a second file header");
  }
  if (operation < BagOperation::file_header || operation > BagOperation::connection) {
    throw BagRecordError("a record of an unexpected kind");
  }
  if (operation != BagOperation::index) close_chunk();
  if (operation == BagOperation::chunk) {
    // A recorder writes the chunk's sizes when the chunk is complete. Until then, the sizes are zero and the content
    // extends to the end of the file.
    const bool unfinished = size == 0 && announced_.index_start == 0;
    Chunk chunk;
    chunk.record = offset;
    chunk.data = data;
    process_chunk(header, std::move(chunk), unfinished ? there : size);
    if (unfinished || size > there) throw BagEnd();
    return data + size;
  }
  if (size > there) throw BagEnd();
  const bool indexed = announced_.index_start != 0 && offset >= announced_.index_start;
  switch (operation) {
    case BagOperation::file_header:
      announced_ = {header.number<std::uint64_t>("index_pos"), header.number<std::uint32_t>("conn_count"),
                    header.number<std::uint32_t>("chunk_count")};
      if (announced_.index_start > magic.size()) read_stated_chunks();  // replaces header_
      break;
    case BagOperation::index:
      process_index(header, data, size);
      break;
    case BagOperation::connection:
      if (size > largest_bag_header) throw BagRecordError(fmt::format("a connection of {} bytes", size));
      file_.read(data, static_cast<std::size_t>(size), buffer_);
      define(header, buffer_);
      indexed_connections_ += indexed ? 1 : 0;
      break;
    case BagOperation::chunk_info:
      indexed_chunks_ += indexed ? 1 : 0;
      break;
    default:
      break;
  }
  return data + size;
}

void BagIndex::process_chunk(const BagHeader& header, Chunk chunk, std::uint64_t size) {
  chunk.cut = size > file_.size() - chunk.data || (announced_.index_start == 0 && size == file_.size() - chunk.data);
  chunk.packed = std::min(size, file_.size() - chunk.data);
  chunk.size = header.number<std::uint32_t>("size");
  chunk.compression = header.text("compression");
  bag_codec(chunk.compression);
  if (chunk.cut && chunk.size == 0) chunk.size = largest_bag_chunk;
  if (chunk.size > largest_bag_chunk || chunk.packed > largest_bag_chunk) {
    throw BagRecordError(fmt::format("a chunk of {} bytes", std::max(chunk.size, chunk.packed)));
  }
  chunks_.push_back(std::move(chunk));
  open_chunk_ = true;
}

void BagIndex::process_index(const BagHeader& header, std::uint64_t data, std::uint64_t size) {
  const std::uint64_t count = header.number<std::uint32_t>("count");
  if (!open_chunk_) throw BagRecordError("an index without a chunk");
  if (count * bag_index_entry_bytes != size)
    throw BagRecordError(fmt::format("an index of {} messages in {} bytes", count, size));
  file_.read(data, static_cast<std::size_t>(size), buffer_);
  MessageCount& messages = chunk_counts_[header.number<std::uint32_t>("conn")];
  for (std::size_t i = 0; i < count; ++i) {
    messages.add(time_of(little_endian<std::uint64_t>(buffer_.data() + i * bag_index_entry_bytes)));
  }
}

void BagIndex::define(const BagHeader& header, std::span<const std::uint8_t> content) {
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

/// Called after all indexes of the last chunk: they count its messages. A chunk without indexes, or with messages of an
/// undescribed connection, is unpacked instead.
void BagIndex::close_chunk() {
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
  for (const auto& [connection, count] : chunk_counts_) {
    counts_[connection].add(count);
    chunk.count.add(count);
  }
  chunk_counts_.clear();
  if (chunk.count.messages == 0) chunks_.pop_back();
}

const Publisher* BagIndex::publisher_of(std::uint32_t channel) const {
  const auto found = publishers_.find(channel);
  return found == publishers_.end() ? nullptr : &found->second;
}

void BagIndex::load(const Chunk& chunk, LoadedSegment& loaded) {
  loaded.bytes.clear();
  loaded.entries.clear();
  std::string wrong;
  try {
    file_.read(chunk.data, static_cast<std::size_t>(chunk.packed), buffer_);
    unpack(bag_codec(chunk.compression), buffer_, chunk.size, chunk.cut ? UnpackedSize::cut_off : UnpackedSize::exact,
           loaded.bytes);
    collect_entries(loaded);
  } catch (const CompressionError& error) {
    wrong = fmt::format("cannot be unpacked: {}", error.what());
  } catch (const BagRecordError& error) {
    wrong = fmt::format("is damaged: {}", error.what());
  }
  std::stable_sort(loaded.entries.begin(), loaded.entries.end(),
                   [](const SegmentEntry& a, const SegmentEntry& b) { return a.time < b.time; });
  const MessageCount& count = chunk.count;
  if (wrong.empty() && count.messages > 0 &&
      (count.messages != static_cast<std::int64_t>(loaded.entries.size()) ||
       count.begin != loaded.entries.front().time)) {
    wrong =
        fmt::format("has {} messages; its index announces {}, or another time", loaded.entries.size(), count.messages);
  }
  if (!wrong.empty() && count.messages > 0) {  // the order of chunks is that of the index
    const auto early =
        std::erase_if(loaded.entries, [&](const SegmentEntry& entry) { return entry.time < count.begin; });
    if (early > 0) wrong += fmt::format("; {} messages before the time in the index are ignored", early);
  }
  if (wrong.empty() || chunk.cut || !lost_.insert(chunk.data).second) return;
  warnings_.add("log.damaged_chunk",
                fmt::format("{}: the chunk at byte {} {}; everything else is read", path(), chunk.record, wrong),
                count.begin);
}

void BagIndex::collect_entries(LoadedSegment& loaded) {
  const std::span<const std::uint8_t> all(loaded.bytes);
  for (std::size_t offset = 0; offset < all.size();) {
    const BagRecordView record = view_record(all, offset);
    const BagHeader header(record.header);
    const std::size_t data = offset + 8 + record.header.size();
    if (header.operation() == BagOperation::message) {
      loaded.entries.push_back({time_of(header.number<std::uint64_t>("time")), header.number<std::uint32_t>("conn"),
                                data, record.end - data});
    } else if (header.operation() == BagOperation::connection) {
      define(header, all.subspan(data, record.end - data));
    }
    offset = record.end;
  }
}

}  // namespace lodestone
