#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "frontends/file_bytes.h"
#include "frontends/logs/ros1/bag_record.h"
#include "frontends/logs/segment_index.h"

namespace lodestone {

/// A ROS 1 bag (format 2.0), read record by record: the index at the end of the file is not required. A bag that is cut
/// off or was not closed is read up to the first incomplete record. Of a bag with altered bytes, all chunks that can be
/// unpacked are read. Lengths and counts in the file are checked before use.
class BagIndex : public SegmentIndex {
 public:
  /// Throws InputError with the byte if the file is missing, is not a ROS 1 bag of version 2.0, or has no message that
  /// can be read. Counts log.cut_off, log.mixed_topic, log.damaged_record and log.damaged_chunk in `warnings`, which
  /// must outlive this.
  BagIndex(const std::string& path, WarningLog& warnings);

  const std::string& path() const override { return file_.path(); }
  const Publisher* publisher_of(std::uint32_t channel) const override;
  std::size_t segment_count() const override { return chunks_.size(); }
  Time begin_of(std::size_t segment) const override { return chunks_[segment].count.begin; }
  void load(std::size_t segment, LoadedSegment& loaded) override { load(chunks_[segment], loaded); }

 private:
  struct Chunk {
    std::uint64_t record = 0;            ///< offset of its record
    std::uint64_t data = 0;              ///< offset of its content
    std::uint64_t packed = 0, size = 0;  ///< bytes; `size` is the limit of the unpacked bytes
    std::string compression;
    bool cut = false;    ///< the file ends within the chunk
    MessageCount count;  ///< from its index records
  };
  /// Announcements of the file's first record.
  struct Announced {
    std::uint64_t index_start = 0;  ///< 0: the recorder did not close the bag
    std::uint32_t connections = 0, chunks = 0;
  };

  /// Of a record. It may end behind the end of the file.
  struct Content {
    std::uint64_t data = 0, size = 0;
  };

  [[noreturn]] void fail(std::uint64_t byte, const std::string& what) const;
  void check_magic() const;
  bool walk(std::uint64_t& offset);
  void read_stated_chunks();
  bool is_chunk(std::uint64_t place);
  std::uint64_t next_stated(std::uint64_t offset) const;
  Content read_header(std::uint64_t offset);
  std::uint64_t process_record(std::uint64_t offset);
  void process_chunk(const BagHeader& header, Chunk chunk, std::uint64_t size);
  void process_index(const BagHeader& header, std::uint64_t data, std::uint64_t size);
  void define(const BagHeader& header, std::span<const std::uint8_t> content);
  void close_chunk();
  void load(const Chunk& chunk, LoadedSegment& loaded);
  void collect_entries(LoadedSegment& loaded);

  FileBytes file_;
  WarningLog& warnings_;
  Announced announced_;
  std::uint32_t indexed_connections_ = 0, indexed_chunks_ = 0;  ///< records at the end of the file
  std::vector<std::uint64_t> stated_;  ///< places of chunks by the index at the end of the file, in order
  bool cut_ = false;
  bool damaged_ = false;       ///< a record outside the chunks
  std::vector<Chunk> chunks_;  ///< in order of begin after construction
  std::map<std::uint32_t, TopicInfo> connections_;
  std::map<std::uint32_t, Publisher> publishers_;  ///< of connections
  std::map<std::uint32_t, MessageCount> counts_;
  std::map<std::uint32_t, MessageCount> chunk_counts_;  ///< of the chunk whose indexes are being read
  bool open_chunk_ = false;                             ///< the last chunk's indexes may follow
  std::set<std::uint64_t> lost_;                        ///< damaged chunks, counted only in the first reading
  std::vector<std::uint8_t> header_, buffer_;
};

}  // namespace lodestone
