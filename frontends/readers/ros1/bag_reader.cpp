#include "frontends/readers/ros1/bag_reader.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "frontends/readers/ros1/serialization.h"

namespace lodestone::ros1 {
namespace {

/// Opens the bag; says in words what rosbag says in offsets.
void open_bag(rosbag::Bag& bag, const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) throw BagError(path + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, code)) throw BagError(path + ": expected a ROS 1 bag, found no regular file");
  static constexpr char magic[] = "#ROSBAG V";
  char start[sizeof(magic) - 1] = {};
  if (std::FILE* file = std::fopen(path.c_str(), "rb")) {
    const std::size_t count = std::fread(start, 1, sizeof(start), file);
    std::fclose(file);
    if (count != sizeof(start) || std::memcmp(start, magic, sizeof(start)) != 0) {
      throw BagError(path + ": is no ROS 1 bag (it does not start with '" + magic + "')");
    }
  } else {
    throw BagError(path + ": cannot be opened for reading; check its permissions");
  }
  try {
    bag.open(path, rosbag::bagmode::Read);
  } catch (const std::exception& error) {
    throw BagError(path + ": the bag is truncated or was not closed by its recorder (" + error.what() +
                   "); repair it with 'rosbag reindex' or record it again");
  }
}

}  // namespace

struct BagReader::Implementation {
  std::string path;
  rosbag::Bag bag;
  std::vector<TopicInfo> topics;
  std::map<std::string, std::size_t> selected;
  std::unique_ptr<rosbag::View> view;
  rosbag::View::iterator position;

  template <class Plain>
  void read(const rosbag::MessageInstance& instance, Message& message) const {
    // A chunk's bytes stay in the bag's buffer until the next chunk is read: the cloud's view points there.
    const auto plain = instance.instantiate<Plain>();
    if (!plain) {
      throw BagError(path + ": topic " + instance.getTopic() + " has a " + instance.getDataType() +
                     " of another version (MD5 " + instance.getMD5Sum() + "); expected that of " +
                     (is_livox_type(instance.getDataType()) ? "livox_ros_driver2" : "ROS Noetic"));
    }
    message = std::move(*plain);
  }
};

BagReader::BagReader(const std::string& path) : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.path = path;
  open_bag(self.bag, path);
  rosbag::View all(self.bag);
  std::map<std::string, TopicInfo> found;
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    // A topic may have several connections: one a publisher.
    rosbag::View one(self.bag, [connection](const rosbag::ConnectionInfo* other) { return other->id == connection->id; });
    TopicInfo& topic = found[connection->topic];
    topic.name = connection->topic;
    topic.type = connection->datatype;
    if (one.size() == 0) continue;
    const Time begin = from_ros(one.getBeginTime());
    const Time end = from_ros(one.getEndTime());
    topic.begin = topic.messages == 0 ? begin : std::min(topic.begin, begin);
    topic.end = topic.messages == 0 ? end : std::max(topic.end, end);
    topic.messages += one.size();
  }
  for (auto& entry : found) self.topics.push_back(std::move(entry.second));
}

BagReader::~BagReader() = default;

const std::vector<TopicInfo>& BagReader::topics() const { return implementation_->topics; }

void BagReader::select(const std::vector<std::string>& topics) {
  Implementation& self = *implementation_;
  self.selected.clear();
  for (std::size_t i = 0; i < topics.size(); ++i) {
    const auto found = std::find_if(self.topics.begin(), self.topics.end(),
                                    [&](const TopicInfo& topic) { return topic.name == topics[i]; });
    if (found == self.topics.end()) throw BagError(self.path + ": there is no topic " + topics[i]);
    if (found->type != "sensor_msgs/PointCloud2" && !is_livox_type(found->type) && found->type != "sensor_msgs/Imu" &&
        found->type != "sensor_msgs/MagneticField") {
      throw BagError(self.path + ": topic " + topics[i] + " is a " + found->type +
                     "; expected sensor_msgs/PointCloud2, Imu or MagneticField, or livox_ros_driver2/CustomMsg");
    }
    self.selected[topics[i]] = i;
  }
  self.view = std::make_unique<rosbag::View>(self.bag, [&self](const rosbag::ConnectionInfo* connection) {
    return self.selected.count(connection->topic) > 0;
  });
  self.position = self.view->begin();
}

bool BagReader::next(Message& message, std::size_t& topic, Time& record_time) {
  Implementation& self = *implementation_;
  if (!self.view || self.position == self.view->end()) return false;
  try {
    const rosbag::MessageInstance& instance = *self.position;
    topic = self.selected.at(instance.getTopic());
    record_time = from_ros(instance.getTime());
    const std::string& type = instance.getDataType();
    if (type == "sensor_msgs/PointCloud2") {
      self.read<PointCloudMessage>(instance, message);
    } else if (is_livox_type(type)) {
      self.read<LivoxMessage>(instance, message);
    } else if (type == "sensor_msgs/Imu") {
      self.read<ImuMessage>(instance, message);
    } else {
      self.read<MagneticFieldMessage>(instance, message);
    }
    ++self.position;
  } catch (const BagError&) {
    throw;
  } catch (const MalformedMessage& error) {
    throw BagError(self.path + ": topic " + self.position->getTopic() + ", recorded at " +
                   std::to_string(record_time / nanoseconds_per_second) + " s: " + error.what() +
                   "; record it again, or cut the bag before it with 'rosbag filter'");
  } catch (const std::exception& error) {
    throw BagError(self.path + ": the bag is damaged (" + error.what() + "); repair it with 'rosbag reindex'");
  }
  return true;
}

}  // namespace lodestone::ros1
