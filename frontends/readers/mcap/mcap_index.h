#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/readers/logs/message_source.h"
#include "frontends/readers/mcap/mcap_records.h"

namespace lodestone::mcap {

/// A piece of the file that is loaded at once: a chunk, or some megabytes of messages that lie in no chunk.
struct Segment {
  std::uint64_t offset = 0;  ///< of a chunk's content; of the first record else
  std::uint64_t size = 0;    ///< bytes in the file
  bool chunk = false;
  bool cut = false;  ///< the file ends within it
  Time begin = 0, end = 0;
};

/// One message of a loaded segment.
struct SegmentEntry {
  Time time = 0;
  std::uint16_t channel = 0;
  std::size_t offset = 0;  ///< of its payload in `bytes`
  std::size_t size = 0;
};

/// A segment's content.
struct LoadedSegment {
  std::vector<std::uint8_t> bytes;
  std::vector<SegmentEntry> entries;  ///< in order of time; equal times in the file's order
};

/// What a walk over a file's records finds: channels, segments, counts. The walk reads the records' prefixes, message
/// indexes, schemas and channels, not the messages; only chunks without an index, as a crash leaves them behind, are unpacked.
/// So it needs no summary section, and believes none.
class McapIndex {
 public:
  /// Throws InputError where the file is missing, no MCAP file, or holds nothing readable. What is lost is counted in
  /// `warnings`: log.cut_off, log.damaged_chunk, log.unknown_channel.
  McapIndex(const std::string& path, WarningLog& warnings);

  const std::string& path() const { return file_.path(); }
  const std::vector<Segment>& segments() const { return segments_; }  ///< in order of begin

  /// Topics in order of name. Channels of one topic are one.
  const std::vector<TopicInfo>& topics() const { return topics_; }
  /// Index into topics() of a channel; -1 where it is unknown, or its type differs from the topic's other channels.
  int topic_of(std::uint16_t channel) const;

  /// Reads a segment; empty, with a warning, where it is damaged.
  void load(const Segment& segment, LoadedSegment& loaded);

 private:
  struct Count {
    std::int64_t messages = 0;
    Time begin = 0, end = 0;
    void add(Time time);
  };

  void walk();
  void take_record(std::uint8_t opcode, std::uint64_t offset, std::uint64_t size);
  void take_message(std::uint64_t record, std::uint64_t size);
  void take_message_index(std::uint64_t offset, std::uint64_t size);
  void close_chunk();
  void read_segment(const Segment& segment, LoadedSegment& loaded);
  void take_entries(LoadedSegment& loaded);
  void define(std::uint8_t opcode, std::span<const std::uint8_t> content);
  void collect_topics();
  void lose(const Segment& segment, const std::string& what);

  FileBytes file_;
  WarningLog& warnings_;
  std::vector<Segment> segments_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::map<std::uint16_t, Count> counts_;
  std::map<std::uint16_t, Count> chunk_counts_;  ///< of the chunk whose indexes are being read
  std::map<std::uint16_t, int> topic_of_channel_;
  std::vector<TopicInfo> topics_;
  bool open_chunk_ = false;  ///< the last segment is a chunk whose indexes may follow
  bool open_run_ = false;    ///< the last segment is a run of messages in no chunk
  std::set<std::uint64_t> lost_;  ///< segments that were found damaged: a second reading does not count them again
  std::vector<std::uint8_t> buffer_;
};

}  // namespace lodestone::mcap
