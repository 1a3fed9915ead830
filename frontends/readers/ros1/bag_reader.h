#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "frontends/readers/ros1/messages.h"

namespace lodestone::ros1 {

struct TopicInfo {
  std::string name;
  std::string type;         ///< for example sensor_msgs/Imu
  std::int64_t messages = 0;
  Time begin = 0;  ///< record time of the first message
  Time end = 0;    ///< record time of the last message
};

/// Whether messages of this type are read as LivoxMessage: both generations of Livox' driver write the same.
inline bool is_livox_type(const std::string& type) {
  return type == "livox_ros_driver2/CustomMsg" || type == "livox_ros_driver/CustomMsg";
}

/// Streams a ROS 1 bag. Holds one chunk and the bag's index, never the messages.
class BagReader {
 public:
  /// Throws BagError where the file is missing, is no ROS 1 bag, or has no index (cut off while recording).
  explicit BagReader(const std::string& path);
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// In order of name.
  const std::vector<TopicInfo>& topics() const;

  /// Chooses the topics that next() returns, and starts from their first message. Throws BagError where one is absent
  /// or is no PointCloud2, CustomMsg, Imu or MagneticField.
  void select(const std::vector<std::string>& topics);

  /// The next message of the chosen topics in order of record time; false at the end. `topic` is the index into the
  /// list given to select(). The points of a cloud stay valid until the next call.
  /// Throws BagError where the bag is damaged.
  bool next(Message& message, std::size_t& topic, Time& record_time);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::ros1
