#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontends/logs/log_conversion.h"
#include "frontends/logs/open_log.h"

namespace lodestone::testing {

/// A copy of a stored message.
struct StoredMessage {
  std::string topic;
  Time time = 0;
  std::string bytes, publisher;  ///< "/node", "/node latching"; empty where the log does not say
  bool operator==(const StoredMessage&) const = default;
};

/// All messages of a log, of all topics.
inline std::vector<StoredMessage> stored_messages(MessageSource& source) {
  std::vector<std::string> names;
  for (const TopicInfo& topic : source.topics()) names.push_back(topic.name);
  source.select(names);
  std::vector<StoredMessage> messages;
  for (RawMessage raw; source.next(raw);) {
    StoredMessage& message = messages.emplace_back();
    message.topic = names[raw.topic];
    message.time = raw.record_time;
    message.bytes.assign(reinterpret_cast<const char*>(raw.data), raw.size);
    if (raw.publisher != nullptr)
      message.publisher = raw.publisher->name + (raw.publisher->latching ? " latching" : "");
  }
  return messages;
}

/// Converts a log like `lodestone convert`.
inline void store_as(const std::string& from, const std::string& to, LogFormat format, Codec codec = Codec::none) {
  WarningLog warnings;
  const auto source = open_log(from, warnings);
  const auto writer = make_log_writer(to, format, codec);
  convert_log(from, *source, *writer, [](Time) {});
  writer->close();
}

inline RawMessage raw_message(Time time, const std::string& bytes, const Publisher* publisher = nullptr) {
  return {time, 0, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), publisher};
}

}  // namespace lodestone::testing
