#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontends/logs/open_log.h"
#include "frontends/messages/message_decoder.h"

namespace lodestone::testing {

/// A log's messages of chosen topics, decoded.
class DecodedLog {
 public:
  explicit DecodedLog(const std::string& path) : source_(open_log(path, warnings)), decoder_(path) {}

  const std::vector<TopicInfo>& topics() const { return source_->topics(); }
  const TopicInfo& topic(const std::string& name) const {
    for (const TopicInfo& info : topics()) {
      if (info.name == name) return info;
    }
    throw InputError("no topic " + name);
  }
  void select(const std::vector<std::string>& names) {
    source_->select(names);
    names_ = names;
  }
  bool next(ros1::Message& message, std::size_t& topic_index, Time& record_time) {
    RawMessage raw;
    if (!source_->next(raw)) return false;
    topic_index = raw.topic;
    record_time = raw.record_time;
    decoder_.decode(topic(names_[raw.topic]), raw, message);
    return true;
  }
  MessageSource& source() { return *source_; }

  WarningLog warnings;

 private:
  std::unique_ptr<MessageSource> source_;
  MessageDecoder decoder_;
  std::vector<std::string> names_;
};

}  // namespace lodestone::testing
