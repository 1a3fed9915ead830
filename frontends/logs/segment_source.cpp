#include "frontends/logs/segment_source.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "frontends/logs/compression.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {
namespace {

constexpr std::size_t largest_overlap = std::size_t{1} << 30;  // bytes in segments that overlap in time

}  // namespace

SegmentSource::SegmentSource(std::unique_ptr<SegmentIndex> index, WarningLog& warnings)
    : index_(std::move(index)), warnings_(warnings) {}

void SegmentSource::select(const std::vector<std::string>& names) {
  selection_ = selection_of(topics(), names, index_->path());
  active_.clear();
  spent_.reset();
  next_segment_ = 0;
  loaded_bytes_ = 0;
  given_ = false;
}

/// Order of the heap; the earliest is in front.
bool SegmentSource::later(const std::unique_ptr<Active>& a, const std::unique_ptr<Active>& b) {
  return a->time() != b->time() ? a->time() > b->time() : a->segment > b->segment;
}

void SegmentSource::load_segment(std::size_t segment) {
  auto active = spent_ != nullptr ? std::move(spent_) : std::make_unique<Active>();
  active->at = 0;
  active->segment = segment;
  LoadedSegment& loaded = active->loaded;
  index_->load(segment, loaded);
  const auto unwanted = [this, segment](const SegmentEntry& entry) {
    const int topic = index_->topic_of(entry.channel);
    if (topic < 0 && segment >= counted_segments_) {
      warnings_.add(
          "log.unknown_channel",
          fmt::format("{}: messages of a channel without definition, or with another type than their topic, are "
                      "ignored",
                      index_->path()),
          entry.time);
    }
    return topic < 0 || selection_[static_cast<std::size_t>(topic)] < 0;
  };
  loaded.entries.erase(std::remove_if(loaded.entries.begin(), loaded.entries.end(), unwanted), loaded.entries.end());
  counted_segments_ = std::max(counted_segments_, segment + 1);
  if (loaded.entries.empty()) {
    spent_ = std::move(active);
    return;
  }
  loaded_bytes_ += loaded.bytes.size();
  if (loaded_bytes_ > largest_overlap) {
    throw InputError(
        fmt::format("{}: more than {} MB of chunks overlap in time; sort the file by time ('mcap sort'; a ROS 1 "
                    "bag: play and record it again)",
                    index_->path(), largest_overlap >> 20));
  }
  active_.push_back(std::move(active));
  std::push_heap(active_.begin(), active_.end(), later);
}

/// Skips the entry that was returned last.
void SegmentSource::advance() {
  if (!given_) return;
  given_ = false;
  std::pop_heap(active_.begin(), active_.end(), later);
  Active& front = *active_.back();
  if (++front.at < front.loaded.entries.size()) {
    std::push_heap(active_.begin(), active_.end(), later);
    return;
  }
  loaded_bytes_ -= front.loaded.bytes.size();
  spent_ = std::move(active_.back());
  active_.pop_back();
}

bool SegmentSource::next(RawMessage& message) {
  if (selection_.empty()) return false;
  while (true) {
    advance();
    while (next_segment_ < index_->segment_count() &&
           (active_.empty() || index_->begin_of(next_segment_) <= active_.front()->time())) {
      load_segment(next_segment_++);
    }
    if (active_.empty()) return false;
    given_ = true;
    if (take(*active_.front(), message)) return true;
  }
}

/// False if the message is packed individually and damaged.
bool SegmentSource::take(const Active& active, RawMessage& message) {
  const SegmentEntry& entry = active.loaded.entries[active.at];
  const TopicInfo& topic = topics()[static_cast<std::size_t>(index_->topic_of(entry.channel))];
  std::span<const std::uint8_t> bytes(active.loaded.bytes.data() + entry.offset, entry.size);
  try {
    if (topic.encoding == Encoding::cdr) bytes = unpacked_cdr(bytes, unpacked_);
  } catch (const CompressionError& error) {
    if (lost_.insert({active.segment, entry.offset}).second) {
      warnings_.add("log.damaged_message",
                    fmt::format("{}: a message of {} cannot be unpacked: {}; it is ignored", index_->path(), topic.name,
                                error.what()),
                    entry.time);
    }
    return false;
  }
  message.record_time = entry.time;
  message.topic = static_cast<std::size_t>(selection_[static_cast<std::size_t>(index_->topic_of(entry.channel))]);
  message.data = bytes.data();
  message.size = bytes.size();
  message.publisher = index_->publisher_of(entry.channel);
  return true;
}

}  // namespace lodestone
