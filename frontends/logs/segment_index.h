#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// One message of a loaded segment.
struct SegmentEntry {
  Time time = 0;
  std::uint32_t channel = 0;  ///< the file's own number of it
  std::size_t offset = 0;     ///< of its payload in `bytes`
  std::size_t size = 0;
};

/// A segment's content.
struct LoadedSegment {
  std::vector<std::uint8_t> bytes;
  std::vector<SegmentEntry> entries;  ///< in order of time; equal times in the file's order
};

/// A log file as pieces that are loaded at once: chunks, or runs of messages that lie in none.
class SegmentIndex {
 public:
  virtual ~SegmentIndex() = default;

  virtual const std::string& path() const = 0;
  /// Topics in order of name. Channels of one topic are one.
  virtual const std::vector<TopicInfo>& topics() const = 0;
  /// Index into topics() of a channel; -1 where it is unknown, or its type differs from the topic's other channels.
  virtual int topic_of(std::uint32_t channel) const = 0;
  /// Who sends what the channel holds; null where the file does not say.
  virtual const Publisher* publisher_of(std::uint32_t) const { return nullptr; }

  virtual std::size_t segment_count() const = 0;
  /// The time of its first message; never before that of the segment ahead of it.
  virtual Time begin_of(std::size_t segment) const = 0;
  /// Reads a segment; what is damaged of it is left out, with a warning.
  virtual void load(std::size_t segment, LoadedSegment& loaded) = 0;
};

/// How many messages, and between which times.
struct MessageCount {
  std::int64_t messages = 0;
  Time begin = 0, end = 0;

  void add(Time time) { add({1, time, time}); }
  void add(const MessageCount& other);
};

/// What the channels of a file are: its topics in order of name, and the topic of each channel.
struct ChannelTopics {
  std::vector<TopicInfo> topics;
  std::map<std::uint32_t, int> topic_of;
};

/// `channels`: of each its topic's name, type, checksum, encoding and definition. Those that differ in type, checksum
/// or encoding from their topic's first are left out and counted: log.mixed_topic. `path` names the file.
ChannelTopics collect_topics(const std::string& path, const std::map<std::uint32_t, TopicInfo>& channels,
                             const std::map<std::uint32_t, MessageCount>& counts, WarningLog& warnings);

}  // namespace lodestone
