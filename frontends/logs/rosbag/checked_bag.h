#pragma once

#include "frontends/logs/ros1/bag_reader.h"
#include "frontends/logs/rosbag/bag_structure.h"

namespace lodestone {

/// A ROS 1 bag, read by rosbag_storage where its structure has been found sound.
class CheckedBag : public MessageSource {
 public:
  /// Throws InputError where the file is missing, is no ROS 1 bag, has no index (cut off while recording), or is damaged. Counts
  /// log.mixed_topic in `warnings`.
  CheckedBag(const std::string& path, WarningLog& warnings) : structure_(path), reader_(path, warnings) {}

  const std::vector<TopicInfo>& topics() const override { return reader_.topics(); }
  void select(const std::vector<std::string>& names) override { reader_.select(names); }
  bool next(RawMessage& message) override {
    Time time = 0;
    if (!reader_.peek(time)) return false;
    structure_.check_until(time);
    return reader_.next(message);
  }

 private:
  BagStructure structure_;
  ros1::BagReader reader_;
};

}  // namespace lodestone
