#include "frontends/logs/ros1/bag_reader.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <filesystem>
#include <map>
#include <set>

#include "frontends/logs/topic_list.h"
#include "frontends/logs/ros1/serialization.h"

namespace lodestone::ros1 {
namespace {

/// The bytes of a message of any type, where they lie in the bag's buffer.
struct BytesView {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

}  // namespace
}  // namespace lodestone::ros1

namespace ros::message_traits {
template <>
struct MD5Sum<lodestone::ros1::BytesView> {
  static const char* value() { return "*"; }
};
}  // namespace ros::message_traits

namespace ros::serialization {
template <>
struct Serializer<lodestone::ros1::BytesView> {
  template <class Stream>
  static void read(Stream& stream, lodestone::ros1::BytesView& view) {
    view.size = stream.getLength();
    view.data = stream.advance(stream.getLength());
  }
};
}  // namespace ros::serialization

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

/// What a connection says of its sender; nothing where the bag was not recorded but written by a program.
Publisher publisher_of(const ros::M_string& header) {
  Publisher publisher;
  if (const auto name = header.find("callerid"); name != header.end()) publisher.name = name->second;
  if (const auto latching = header.find("latching"); latching != header.end()) publisher.latching = latching->second == "1";
  return publisher;
}

}  // namespace

struct BagReader::Implementation {
  std::string path;
  rosbag::Bag bag;
  std::vector<TopicInfo> topics;
  std::set<std::uint32_t> left_out;  ///< connections
  std::map<const ros::M_string*, Publisher> publishers;  ///< by the connection's header
  std::map<std::string, std::size_t> selected;
  std::unique_ptr<rosbag::View> view;
  rosbag::View::iterator position;
  boost::shared_ptr<BytesView> bytes;
};

BagReader::BagReader(const std::string& path, WarningLog& warnings) : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.path = path;
  open_bag(self.bag, path);
  rosbag::View all(self.bag);
  std::map<std::string, TopicInfo> found;
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    // A topic may have several connections: one a publisher.
    rosbag::View one(self.bag, [connection](const rosbag::ConnectionInfo* other) { return other->id == connection->id; });
    const auto [entry, is_new] = found.try_emplace(connection->topic);
    TopicInfo& topic = entry->second;
    if (is_new) {
      topic.name = connection->topic;
      topic.type = connection->datatype;
      topic.md5 = connection->md5sum;
      topic.definition = connection->msg_def;
    }
    if (topic.type != connection->datatype || topic.md5 != connection->md5sum) {
      self.left_out.insert(connection->id);
      warnings.add("log.mixed_topic",
                   path + ": " + topic.name + " holds messages of two types; those of " + connection->datatype +
                       (topic.type == connection->datatype ? " (MD5 " + connection->md5sum + ")" : "") + " are left out", 0);
      continue;
    }
    const ros::M_string& header = *connection->header;
    if (header.count("callerid") + header.count("latching") > 0) self.publishers[&header] = publisher_of(header);
    if (one.size() == 0) continue;
    add_messages(topic, from_ros(one.getBeginTime()), from_ros(one.getEndTime()), one.size());
  }
  for (auto& entry : found) self.topics.push_back(std::move(entry.second));
}

BagReader::~BagReader() = default;

const std::vector<TopicInfo>& BagReader::topics() const { return implementation_->topics; }

void BagReader::select(const std::vector<std::string>& names) {
  Implementation& self = *implementation_;
  selection_of(self.topics, names, self.path);
  self.selected.clear();
  for (std::size_t i = 0; i < names.size(); ++i) self.selected[names[i]] = i;
  self.view = std::make_unique<rosbag::View>(self.bag, [&self](const rosbag::ConnectionInfo* connection) {
    return self.selected.count(connection->topic) > 0 && self.left_out.count(connection->id) == 0;
  });
  self.position = self.view->begin();
}

bool BagReader::peek(Time& record_time) const {
  const Implementation& self = *implementation_;
  if (!self.view || self.position == self.view->end()) return false;
  record_time = from_ros(self.position->getTime());
  return true;
}

bool BagReader::next(RawMessage& message) {
  Implementation& self = *implementation_;
  if (!peek(message.record_time)) return false;
  try {
    const rosbag::MessageInstance& instance = *self.position;
    message.topic = self.selected.at(instance.getTopic());
    const auto publisher = self.publishers.find(instance.getConnectionHeader().get());
    message.publisher = publisher == self.publishers.end() ? nullptr : &publisher->second;
    // A chunk's bytes stay in the bag's buffer until the next chunk is read.
    self.bytes = instance.instantiate<BytesView>();
    message.data = self.bytes->data;
    message.size = self.bytes->size;
    ++self.position;
  } catch (const std::exception& error) {
    throw BagError(self.path + ": the bag is damaged (" + error.what() + "); repair it with 'rosbag reindex'");
  }
  return true;
}

}  // namespace lodestone::ros1
