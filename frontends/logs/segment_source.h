#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/segment_index.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Streams a file of segments in order of record time. Memory contains the segments that overlap in time, usually one
/// or two.
class SegmentSource : public MessageSource {
 public:
  /// Counts log.unknown_channel and log.damaged_message in `warnings`, which must outlive this.
  SegmentSource(std::unique_ptr<SegmentIndex> index, WarningLog& warnings);

  const std::vector<TopicInfo>& topics() const override { return index_->topics(); }
  void select(const std::vector<std::string>& names) override;

  /// Throws InputError if the segments that overlap in time do not fit in memory.
  bool next(RawMessage& message) override;

 private:
  struct Active {
    LoadedSegment loaded;
    std::size_t at = 0;       ///< index of the next entry
    std::size_t segment = 0;  ///< its index; at equal times, the earlier in the file comes first
    Time time() const { return loaded.entries[at].time; }
  };
  static bool later(const std::unique_ptr<Active>& a, const std::unique_ptr<Active>& b);
  void load_segment(std::size_t segment);
  void advance();
  bool take(const Active& active, RawMessage& message);

  std::unique_ptr<SegmentIndex> index_;
  WarningLog& warnings_;
  std::vector<int> selection_;                   ///< of each topic: index into the list of select(), or -1
  std::vector<std::unique_ptr<Active>> active_;  ///< a heap, the earliest in front
  std::unique_ptr<Active> spent_;                ///< the last message may refer to its bytes
  std::size_t next_segment_ = 0;
  std::size_t loaded_bytes_ = 0;
  std::size_t counted_segments_ = 0;                    ///< segments with unknown channels already counted
  bool given_ = false;                                  ///< the front's entry has been returned
  std::vector<std::uint8_t> unpacked_;                  ///< the last message, if it was packed individually
  std::set<std::pair<std::size_t, std::size_t>> lost_;  ///< segment and offset of damaged messages, counted only once
};

}  // namespace lodestone
