#include "frontends/logs/merged_source.h"

#include <algorithm>
#include <limits>
#include <map>

#include "frontends/messages/topic_list.h"

namespace lodestone {

MergedSource::MergedSource(std::string path, std::vector<std::unique_ptr<MessageSource>> parts)
    : path_(std::move(path)) {
  std::map<std::string, TopicInfo> found;
  for (auto& source : parts) {
    Part part;
    part.begin = std::numeric_limits<Time>::max();
    for (const TopicInfo& info : source->topics()) {
      if (info.messages > 0) part.begin = std::min(part.begin, info.begin);
      const auto [entry, is_new] = found.try_emplace(info.name, info);
      if (is_new) continue;
      add_messages(entry->second, info.begin, info.end, info.messages);
    }
    part.source = std::move(source);
    parts_.push_back(std::move(part));
  }
  for (auto& [name, topic] : found) topics_.push_back(std::move(topic));
  std::stable_sort(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) { return a.begin < b.begin; });
}

void MergedSource::select(const std::vector<std::string>& names) {
  selection_of(topics_, names, path_);
  given_ = nullptr;
  for (Part& part : parts_) {
    std::vector<std::string> held;
    part.topics.clear();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto& there = part.source->topics();
      if (std::none_of(there.begin(), there.end(), [&](const TopicInfo& topic) { return topic.name == names[i]; }))
        continue;
      held.push_back(names[i]);
      part.topics.push_back(i);
    }
    part.source->select(held);
    part.started = false;
    part.ended = held.empty();
  }
}

void MergedSource::advance(Part& part) {
  part.started = true;
  part.ended = !part.source->next(part.head);
  if (!part.ended) part.head.topic = part.topics[part.head.topic];
}

bool MergedSource::next(RawMessage& message) {
  if (given_ != nullptr) advance(*given_);
  given_ = nullptr;
  for (Part& part : parts_) {
    if (part.ended) continue;
    // Parts are in order of begin: a part that has not begun yet need not load a chunk.
    if (!part.started && given_ != nullptr && part.begin > given_->head.record_time) break;
    if (!part.started) advance(part);
    if (!part.ended && (given_ == nullptr || part.head.record_time < given_->head.record_time)) given_ = &part;
  }
  if (given_ == nullptr) return false;
  message = given_->head;
  return true;
}

}  // namespace lodestone
