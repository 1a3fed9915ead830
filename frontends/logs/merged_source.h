#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "frontends/messages/message_source.h"

namespace lodestone {

/// Several files of one recording as one log, in order of record time. At equal times, the earlier file comes first.
class MergedSource : public MessageSource {
 public:
  /// `path` names the log in messages. At least one part. Throws InputError if a topic has two types.
  MergedSource(std::string path, std::vector<std::unique_ptr<MessageSource>> parts);

  const std::vector<TopicInfo>& topics() const override { return topics_; }
  void select(const std::vector<std::string>& names) override;
  bool next(RawMessage& message) override;

 private:
  struct Part {
    std::unique_ptr<MessageSource> source;
    Time begin = 0;                   ///< time of the first message
    std::vector<std::size_t> topics;  ///< of its selection: index into the list of select()
    RawMessage head;
    bool started = false, ended = false;
  };
  void advance(Part& part);

  std::string path_;
  std::vector<Part> parts_;  ///< in order of begin
  std::vector<TopicInfo> topics_;
  Part* given_ = nullptr;  ///< part of the last returned message
};

}  // namespace lodestone
