#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/message_source.h"
#include "frontends/logs/ros1/messages.h"

namespace lodestone::ros1 {

/// Streams a ROS 1 bag through rosbag_storage. Holds one chunk and the bag's index, never the messages. Believes what the
/// file says of its own lengths: CheckedBag looks first.
class BagReader : public MessageSource {
 public:
  /// Throws BagError where the file is missing, is no ROS 1 bag, or has no index (cut off while recording). Connections of another
  /// type than their topic's first are left out and counted in `warnings`: log.mixed_topic.
  BagReader(const std::string& path, WarningLog& warnings);
  ~BagReader() override;
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  const std::vector<TopicInfo>& topics() const override;
  void select(const std::vector<std::string>& names) override;

  /// The record time of the message that next() will give, by the index alone; false at the end.
  bool peek(Time& record_time) const;

  bool next(RawMessage& message) override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::ros1
