#include "frontends/logs/segment_index.h"

#include <fmt/format.h>

#include <algorithm>

namespace lodestone {

void MessageCount::add(const MessageCount& other) {
  if (other.messages == 0) return;
  begin = messages == 0 ? other.begin : std::min(begin, other.begin);
  end = messages == 0 ? other.end : std::max(end, other.end);
  messages += other.messages;
}

ChannelTopics collect_topics(const std::string& path, const std::map<std::uint32_t, TopicInfo>& channels,
                             const std::map<std::uint32_t, MessageCount>& counts, WarningLog& warnings) {
  std::map<std::string, TopicInfo> found;
  std::vector<std::uint32_t> taken;
  for (const auto& [id, info] : channels) {
    TopicInfo& topic = found.try_emplace(info.name, info).first->second;
    if (topic.type != info.type || topic.md5 != info.md5 || topic.encoding != info.encoding) {
      warnings.add("log.mixed_topic",
                   fmt::format("{}: {} has messages of two types; those of {} are ignored", path, info.name,
                               info.type.empty() ? "an unknown type" : info.type),
                   0);
      continue;
    }
    taken.push_back(id);
    const auto count = counts.find(id);
    if (count != counts.end()) add_messages(topic, count->second.begin, count->second.end, count->second.messages);
  }
  ChannelTopics result;
  std::map<std::string, int> place;
  for (auto& [name, topic] : found) {
    place[name] = static_cast<int>(result.topics.size());
    result.topics.push_back(std::move(topic));
  }
  for (const std::uint32_t id : taken) result.topic_of[id] = place.at(channels.at(id).name);
  return result;
}

}  // namespace lodestone
