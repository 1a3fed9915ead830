#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "frontends/logs/file_bytes.h"
#include "frontends/logs/segment_index.h"
#include "frontends/logs/rosbag/bag_record.h"

namespace lodestone {

/// A ROS 1 bag that its recorder did not close, or of which the end is missing: what `rosbag reindex` would find. The walk
/// over its records goes to the first that is not whole; chunks without a whole index, the last one mostly, are unpacked.
class CutBag : public SegmentIndex {
 public:
  /// Throws InputError where no message can be read. Counts log.cut_off, and log.damaged_chunk, in `warnings`, which must
  /// outlive this.
  CutBag(const std::string& path, WarningLog& warnings);

  const std::string& path() const override { return file_.path(); }
  const std::vector<TopicInfo>& topics() const override { return topics_.topics; }
  int topic_of(std::uint32_t channel) const override;
  const Publisher* publisher_of(std::uint32_t channel) const override;
  std::size_t segment_count() const override { return chunks_.size(); }
  Time begin_of(std::size_t segment) const override { return chunks_[segment].begin; }
  void load(std::size_t segment, LoadedSegment& loaded) override { load(chunks_[segment], loaded); }

 private:
  struct Chunk {
    std::uint64_t data = 0;  ///< where its content starts
    std::uint64_t packed = 0, size = 0;  ///< bytes, unpacked at most so many
    std::string compression;
    bool cut = false;  ///< the file ends within it
    Time begin = 0, end = 0;
  };

  std::uint64_t walk();
  std::uint64_t take_record(std::uint64_t offset);
  void take_chunk(const BagHeader& header, std::uint64_t data, std::uint64_t size);
  void take_index(const BagHeader& header, std::uint64_t data, std::uint64_t size);
  void define(const BagHeader& header, std::span<const std::uint8_t> content);
  void close_chunk();
  void load(const Chunk& chunk, LoadedSegment& loaded);
  void take_entries(LoadedSegment& loaded);

  FileBytes file_;
  WarningLog& warnings_;
  std::vector<Chunk> chunks_;  ///< in order of begin after construction
  std::map<std::uint32_t, TopicInfo> connections_;
  std::map<std::uint32_t, Publisher> publishers_;  ///< of connections
  std::map<std::uint32_t, MessageCount> counts_;
  std::map<std::uint32_t, MessageCount> chunk_counts_;  ///< of the chunk whose indexes are being read
  ChannelTopics topics_;
  bool open_chunk_ = false;       ///< the last chunk's indexes may follow
  std::set<std::uint64_t> lost_;  ///< chunks that were found damaged: a second reading does not count them again
  std::vector<std::uint8_t> header_, buffer_;
};

}  // namespace lodestone
