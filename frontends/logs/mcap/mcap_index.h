#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/mcap/mcap_records.h"
#include "frontends/logs/segment_index.h"

namespace lodestone::mcap {

/// A part of the file that is loaded at once: a chunk, or some megabytes of messages outside chunks.
struct Segment {
  std::uint64_t offset = 0;  ///< of a chunk's content, or of the first record
  std::uint64_t size = 0;    ///< bytes in the file
  bool chunk = false;
  bool cut = false;  ///< the file ends within the segment
  Time begin = 0, end = 0;
};

/// Index of a file, built from its records: channels, segments, counts. Reads the records' prefixes, message indexes,
/// schemas and channels, but no messages. Only chunks without an index, as after a crash, are unpacked. The summary
/// section is neither required nor trusted.
class McapIndex : public SegmentIndex {
 public:
  /// Throws InputError if the file is missing, is not an MCAP file, or has nothing readable. Losses are counted in
  /// `warnings`: log.cut_off, log.damaged_chunk, log.unknown_channel.
  McapIndex(const std::string& path, WarningLog& warnings);

  const std::string& path() const override { return file_.path(); }
  std::size_t segment_count() const override { return segments_.size(); }
  Time begin_of(std::size_t segment) const override { return segments_[segment].begin; }
  void load(std::size_t segment, LoadedSegment& loaded) override { load(segments_[segment], loaded); }

 private:
  void walk();
  void process_record(std::uint8_t opcode, std::uint64_t offset, std::uint64_t size);
  void process_message(std::uint64_t record, std::uint64_t size);
  void process_message_index(std::uint64_t offset, std::uint64_t size);
  void close_chunk();
  void load(const Segment& segment, LoadedSegment& loaded);
  void read_segment(const Segment& segment, LoadedSegment& loaded);
  void collect_entries(LoadedSegment& loaded);
  void define(std::uint8_t opcode, std::span<const std::uint8_t> content);
  void name_topics();
  void report_loss(const Segment& segment, const std::string& what);

  FileBytes file_;
  WarningLog& warnings_;
  std::vector<Segment> segments_;  ///< in order of begin after construction
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint32_t, Channel> channels_;
  std::map<std::uint32_t, MessageCount> counts_;
  std::map<std::uint32_t, MessageCount> chunk_counts_;  ///< of the chunk whose indexes are being read
  bool open_chunk_ = false;                             ///< the last segment is a chunk whose indexes may follow
  bool open_run_ = false;                               ///< the last segment is a run of messages outside chunks
  std::set<std::uint64_t> lost_;                        ///< damaged segments, counted only in the first reading
  std::vector<std::uint8_t> buffer_;
};

}  // namespace lodestone::mcap
