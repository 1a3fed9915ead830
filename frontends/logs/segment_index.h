#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// One message of a loaded segment.
struct SegmentEntry {
  Time time = 0;
  std::uint32_t channel = 0;  ///< id in the file
  std::size_t offset = 0;     ///< of the payload in `bytes`
  std::size_t size = 0;
};

/// A segment's content.
struct LoadedSegment {
  std::vector<std::uint8_t> bytes;
  std::vector<SegmentEntry> entries;  ///< in order of time; equal times in the file's order
};

/// The channels of a file: its topics in order of name, and the topic of each channel.
struct ChannelTopics {
  std::vector<TopicInfo> topics;
  std::map<std::uint32_t, int> topic_of;
};

/// A log file as segments that are loaded at once: chunks, or runs of messages outside chunks.
class SegmentIndex {
 public:
  virtual ~SegmentIndex() = default;

  virtual const std::string& path() const = 0;
  /// Topics in order of name. All channels of a topic are merged.
  const std::vector<TopicInfo>& topics() const { return topics_.topics; }
  /// Index into topics() of a channel; -1 if it is unknown, or if its type differs from the topic's other channels.
  int topic_of(std::uint32_t channel) const {
    const auto found = topics_.topic_of.find(channel);
    return found == topics_.topic_of.end() ? -1 : found->second;
  }
  /// The sender of a channel's messages; null if unknown.
  virtual const Publisher* publisher_of(std::uint32_t) const { return nullptr; }

  virtual std::size_t segment_count() const = 0;
  /// The time of the first message; never before that of the previous segment.
  virtual Time begin_of(std::size_t segment) const = 0;
  /// Reads a segment. Damaged messages are ignored with a warning.
  virtual void load(std::size_t segment, LoadedSegment& loaded) = 0;

 protected:
  ChannelTopics topics_;
};

/// Number of messages, and their first and last time.
struct MessageCount {
  std::int64_t messages = 0;
  Time begin = 0, end = 0;

  void add(Time time) { add({1, time, time}); }
  void add(const MessageCount& other);
};

/// `channels`: name, type, checksum, encoding and definition of each channel's topic. Channels that differ in type,
/// checksum or encoding from their topic's first are ignored and counted: log.mixed_topic. `path` names the file.
ChannelTopics collect_topics(const std::string& path, const std::map<std::uint32_t, TopicInfo>& channels,
                             const std::map<std::uint32_t, MessageCount>& counts, WarningLog& warnings);

}  // namespace lodestone
