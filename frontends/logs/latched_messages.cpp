#include "frontends/logs/latched_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "frontends/messages/known_types.h"

namespace lodestone {
namespace {

constexpr std::size_t most_latched_messages = 100;      // per topic
constexpr std::size_t most_latched_bytes = 64U << 20U;  // per topic

/// True if one of a list of QoS profiles of a ROS 2 recorder latches. Older recorders wrote the policy's number.
bool names_transient_local(std::string_view profiles) {
  constexpr std::string_view key = "durability:";
  for (std::size_t at = profiles.find(key); at != std::string_view::npos; at = profiles.find(key, at)) {
    at += key.size();
    const std::string_view rest = profiles.substr(std::min(profiles.find_first_not_of(" \"'", at), profiles.size()));
    const std::string_view policy = rest.substr(0, rest.find_first_of(" \"',}\r\n"));
    if (policy == "transient_local" || policy == "1") return true;
  }
  return false;
}

bool latches_by_profile(const TopicInfo& topic) {
  const auto profiles = topic.metadata.find("offered_qos_profiles");
  return profiles != topic.metadata.end() && names_transient_local(profiles->second);
}

}  // namespace

LatchedMessages::LatchedMessages(const std::vector<const TopicInfo*>& topics) {
  for (const TopicInfo* info : topics) {
    Topic& topic = topics_.emplace_back();
    topic.info = info;
    topic.latches = latches_by_profile(*info);
    topic.last_only = message_type(info->type) != MessageType::other;
  }
}

void LatchedMessages::add(const RawMessage& message) {
  Topic& topic = topics_[message.topic];
  const Publisher* publisher = message.publisher;
  if (!(publisher != nullptr ? publisher->latching : topic.latches)) return;
  const auto drop = [&topic](std::deque<Kept>::iterator kept) {
    topic.bytes -= kept->bytes.size();
    topic.kept.erase(kept);
  };
  const auto replaced = std::find_if(topic.kept.begin(), topic.kept.end(), [&](const Kept& earlier) {
    if (publisher == nullptr || earlier.publisher == nullptr) return publisher == earlier.publisher && topic.last_only;
    // Each file of a folder has its own Publisher for the same node.
    return publisher == earlier.publisher || (!publisher->name.empty() && publisher->name == earlier.publisher->name);
  });
  if (replaced != topic.kept.end()) drop(replaced);
  topic.kept.push_back({next_place_++, publisher, {message.data, message.data + message.size}});
  topic.bytes += message.size;
  while (topic.kept.size() > 1 && (topic.kept.size() > most_latched_messages || topic.bytes > most_latched_bytes)) {
    drop(topic.kept.begin());
    ++topic.left_out;
    topic.last_left_out = message.record_time;
  }
}

std::vector<RawMessage> LatchedMessages::recorded_at(Time time) const {
  std::vector<std::pair<std::int64_t, RawMessage>> places;
  for (std::size_t topic = 0; topic < topics_.size(); ++topic) {
    for (const Kept& kept : topics_[topic].kept) {
      places.push_back({kept.place, {time, topic, kept.bytes.data(), kept.bytes.size(), kept.publisher}});
    }
  }
  std::sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<RawMessage> messages;
  for (const auto& [place, message] : places) messages.push_back(message);
  return messages;
}

void LatchedMessages::report(const std::string& path, WarningLog& warnings) const {
  for (const Topic& topic : topics_) {
    if (topic.left_out == 0) continue;
    warnings.add(
        "log.latched_left_out",
        fmt::format(
            "{}: latched topic {}: the part begins with the last {} earlier messages, {:.1f} MB; older messages "
            "are omitted; if they are required, begin the part earlier",
            path, topic.info->name, topic.kept.size(), static_cast<double>(topic.bytes) * 1e-6),
        topic.last_left_out, topic.left_out);
  }
}

}  // namespace lodestone
