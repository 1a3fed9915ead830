#include "frontends/logs/rosbag/bag_structure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string_view>

#include "core/error.h"
#include "frontends/logs/rosbag/bag_record.h"

namespace lodestone {
namespace {

constexpr std::string_view magic = "#ROSBAG V2.0\n";
}  // namespace

/// One record of the file. Only its header is read.
struct BagStructure::Record {
  std::uint64_t offset = 0;  ///< of the record
  std::uint64_t data = 0;    ///< of its content
  std::uint32_t size = 0;    ///< of its content, bytes
  std::vector<std::uint8_t> bytes;
  BagHeader header;
  std::uint64_t end() const { return data + size; }
};

void BagStructure::fail(std::uint64_t byte, const std::string& what) const {
  throw InputError(fmt::format("{}: the bag is damaged at byte {}: {}; repair it with 'rosbag reindex', or record it again",
                               file_.path(), byte, what));
}

void BagStructure::fail_truncated(const std::string& what) const {
  throw BagCutOff(fmt::format("{}: the bag is truncated or was not closed by its recorder ({}); repair it with 'rosbag "
                               "reindex' or record it again",
                               file_.path(), what));
}

BagStructure::BagStructure(const std::string& path) : file_(path) {
  std::vector<std::uint8_t> start;
  file_.read(0, std::min<std::size_t>(magic.size(), file_.size()), start);
  const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  if (!text.starts_with("#ROSBAG V")) throw InputError(path + ": is no ROS 1 bag (it does not start with '#ROSBAG V')");
  if (text.size() < magic.size()) fail_truncated(fmt::format("it has {} bytes", file_.size()));
  if (text != magic) {
    throw InputError(path + ": is a ROS 1 bag of another version than 2.0; convert it with 'rosbag fix' of ROS Noetic");
  }
  walk();
  std::stable_sort(chunks_.begin(), chunks_.end(), [](const Chunk& a, const Chunk& b) { return a.begin < b.begin; });
}

BagStructure::Record BagStructure::read_record(std::uint64_t offset) const {
  Record record;
  record.offset = offset;
  const auto number_at = [&](std::uint64_t at) {
    if (at + 4 > file_.size()) fail_truncated(fmt::format("the record at byte {} is not there whole", offset));
    std::uint8_t bytes[4];
    file_.read(at, bytes);
    return little_endian<std::uint32_t>(bytes);
  };
  const std::uint32_t header_size = number_at(offset);
  if (header_size > largest_bag_header) fail(offset, fmt::format("a record's header of {} bytes", header_size));
  record.size = number_at(offset + 4 + header_size);
  record.data = offset + 8 + header_size;
  if (record.end() > file_.size()) {
    fail_truncated(fmt::format("the record at byte {} ends at byte {} of {}", offset, record.end(), file_.size()));
  }
  file_.read(offset + 4, header_size, record.bytes);
  try {
    record.header = BagHeader(record.bytes);
  } catch (const BagRecordError& error) {
    fail(offset, error.what());
  }
  return record;
}

void BagStructure::walk() {
  std::uint64_t offset = magic.size();
  std::uint64_t index_start = 0;  // as the file's first record says it
  std::uint64_t first_of_index = 0;
  std::uint32_t connections = 0, chunks = 0, connections_said = 0, chunks_said = 0;
  for (std::size_t i = 0; offset < file_.size(); ++i) {
    const Record record = read_record(offset);
    try {
      const BagOperation operation = record.header.operation();
      if ((i == 0) != (operation == BagOperation::file_header)) {
        fail(offset, i == 0 ? "the first record is no file header" : "a second file header");
      }
      // What lies ahead of the index, rosbag_storage does not look at.
      const bool in_index = offset >= index_start && index_start != 0 &&
                            (operation == BagOperation::connection || operation == BagOperation::chunk_info);
      if (in_index && first_of_index == 0) first_of_index = offset;
      switch (operation) {
        case BagOperation::file_header:
          index_start = record.header.number<std::uint64_t>("index_pos");
          connections_said = record.header.number<std::uint32_t>("conn_count");
          chunks_said = record.header.number<std::uint32_t>("chunk_count");
          if (index_start == 0) fail_truncated("its header names no index");
          break;
        case BagOperation::chunk:
          add_chunk(record);
          break;
        case BagOperation::index:
          add_index(record);
          break;
        case BagOperation::connection:
          check_connection(record);
          connections += in_index ? 1 : 0;
          break;
        case BagOperation::chunk_info:
          check_chunk_info(record);
          chunks += in_index ? 1 : 0;
          break;
        default:
          fail(offset, "a record of a kind that does not belong there");
      }
    } catch (const BagRecordError& error) {
      fail(offset, error.what());
    }
    offset = record.end();
  }
  if (index_start != first_of_index && !(first_of_index == 0 && index_start == file_.size())) {
    if (index_start >= file_.size()) fail_truncated(fmt::format("its index is said to lie at byte {}", index_start));
    fail(magic.size(), fmt::format("the index is said to lie at byte {}; it lies at {}", index_start, first_of_index));
  }
  if (connections < connections_said || chunks < chunks_said) {
    fail_truncated(fmt::format("{} of {} chunks are in its index", chunks, chunks_said));
  }
  if (connections != connections_said || chunks != chunks_said) {
    fail(magic.size(), fmt::format("{} connections and {} chunks are announced; the index has {} and {}", connections_said,
                                   chunks_said, connections, chunks));
  }
}

void BagStructure::add_chunk(const Record& record) {
  Chunk chunk;
  chunk.record = record.offset;
  chunk.data = record.data;
  chunk.packed = record.size;
  chunk.size = record.header.number<std::uint32_t>("size");
  chunk.compression = record.header.text("compression");
  bag_codec(chunk.compression);
  chunk.begin = std::numeric_limits<Time>::max();
  if (chunk.size > largest_bag_chunk) fail(record.offset, fmt::format("a chunk of {} bytes", chunk.size));
  chunks_.push_back(std::move(chunk));
}

void BagStructure::add_index(const Record& record) {
  if (chunks_.empty()) fail(record.offset, "an index before the first chunk");
  Chunk& chunk = chunks_.back();
  if (record.header.number<std::uint32_t>("ver") != 1) fail(record.offset, "an index of another version than 1");
  const IndexRecord index{record.header.number<std::uint32_t>("conn"), record.header.number<std::uint32_t>("count"),
                          record.data};
  if (std::uint64_t{index.count} * bag_index_entry_bytes != record.size) {
    fail(record.offset, fmt::format("an index of {} messages in {} bytes", index.count, record.size));
  }
  file_.read(index.offset, record.size, entries_);
  for (std::size_t i = 0; i < index.count; ++i) {
    const std::uint8_t* entry = entries_.data() + i * bag_index_entry_bytes;
    const Time time = Time{little_endian<std::uint32_t>(entry)} * 1'000'000'000 + little_endian<std::uint32_t>(entry + 4);
    chunk.begin = std::min(chunk.begin, time);
    if (little_endian<std::uint32_t>(entry + 8) >= chunk.size) {
      fail(index.offset + i * bag_index_entry_bytes, "an index points beyond its chunk");
    }
  }
  chunk.indexes.push_back(index);
}

void BagStructure::check_connection(const Record& record) const {
  record.header.number<std::uint32_t>("conn");
  record.header.text("topic");
  if (record.size > largest_bag_header) fail(record.offset, fmt::format("a connection of {} bytes", record.size));
  std::vector<std::uint8_t> bytes;
  file_.read(record.data, record.size, bytes);
  const BagHeader description(bytes);
  for (const char* key : {"md5sum", "type", "message_definition"}) description.text(key);
}

void BagStructure::check_chunk_info(const Record& record) {
  if (record.header.number<std::uint32_t>("ver") != 1) fail(record.offset, "a chunk info of another version than 1");
  const auto position = record.header.number<std::uint64_t>("chunk_pos");
  const auto count = record.header.number<std::uint32_t>("count");
  record.header.number<std::uint64_t>("start_time");
  record.header.number<std::uint64_t>("end_time");
  // The walk has come by the chunks in their order in the file.
  const auto found = std::lower_bound(chunks_.begin(), chunks_.end(), position,
                                      [](const Chunk& chunk, std::uint64_t at) { return chunk.record < at; });
  if (found == chunks_.end() || found->record != position) {
    fail(record.offset, fmt::format("there is no chunk at byte {}", position));
  }
  if (record.size != std::uint64_t{count} * 8 || found->indexes.size() != count) {
    fail(record.offset, fmt::format("a chunk of {} connections has {} indexes", count, found->indexes.size()));
  }
}

void BagStructure::check_until(Time time) {
  for (; checked_ < chunks_.size() && chunks_[checked_].begin <= time; ++checked_) {
    try {
      check_chunk(chunks_[checked_]);
    } catch (const BagRecordError& error) {
      fail(chunks_[checked_].record, error.what());
    } catch (const CompressionError& error) {
      fail(chunks_[checked_].record, std::string("a chunk cannot be unpacked: ") + error.what());
    }
    chunks_[checked_].indexes = {};
  }
}

void BagStructure::check_chunk(const Chunk& chunk) {
  file_.read(chunk.data, chunk.packed, packed_);
  unpack(bag_codec(chunk.compression), packed_, chunk.size, UnpackedSize::exact, content_);
  struct Start {
    std::uint32_t offset;
    std::int64_t connection;  // of a message; -1 for the description of a connection
  };
  std::vector<Start> starts;
  for (std::size_t offset = 0; offset < content_.size();) {
    const BagRecordView record = view_record(content_, offset);
    const BagHeader header(record.header);
    const bool message = header.operation() == BagOperation::message;
    if (message && header.number<std::uint64_t>("time") == 0) throw BagRecordError("a message without a time");
    starts.push_back({static_cast<std::uint32_t>(offset),
                      message ? std::int64_t{header.number<std::uint32_t>("conn")} : std::int64_t{-1}});
    offset = record.end;
  }
  for (const IndexRecord& index : chunk.indexes) {
    file_.read(index.offset, index.count * bag_index_entry_bytes, entries_);
    for (std::size_t i = 0; i < index.count; ++i) {
      const auto offset = little_endian<std::uint32_t>(entries_.data() + i * bag_index_entry_bytes + 8);
      const auto found = std::lower_bound(starts.begin(), starts.end(), offset,
                                          [](const Start& start, std::uint32_t value) { return start.offset < value; });
      if (found == starts.end() || found->offset != offset ||
          (found->connection >= 0 && found->connection != index.connection)) {
        throw BagRecordError(fmt::format("the index points to byte {} of the chunk, where no message of its topic starts",
                                         offset));
      }
    }
  }
}

}  // namespace lodestone
