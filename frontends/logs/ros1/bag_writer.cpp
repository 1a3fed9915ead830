#include "frontends/logs/ros1/bag_writer.h"

#include <rosbag/bag.h>

#include <boost/make_shared.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
#include <tuple>

#include "frontends/configuration/aside.h"
#include "frontends/logs/ros1/serialization.h"

namespace lodestone::ros1 {
namespace {

/// A message that is serialized already, with what a bag says of its type.
struct SerializedMessage {
  std::string type, md5, definition;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

template <class Message>
bool describe_as(SerializedMessage& message) {
  if (message.type != ros::message_traits::DataType<Message>::value()) return false;
  message.md5 = ros::message_traits::MD5Sum<Message>::value();
  message.definition = ros::message_traits::Definition<Message>::value();
  return true;
}

}  // namespace
}  // namespace lodestone::ros1

namespace ros::message_traits {
template <>
struct MD5Sum<lodestone::ros1::SerializedMessage> {
  static const char* value(const lodestone::ros1::SerializedMessage& message) { return message.md5.c_str(); }
};
template <>
struct DataType<lodestone::ros1::SerializedMessage> {
  static const char* value(const lodestone::ros1::SerializedMessage& message) { return message.type.c_str(); }
};
template <>
struct Definition<lodestone::ros1::SerializedMessage> {
  static const char* value(const lodestone::ros1::SerializedMessage& message) { return message.definition.c_str(); }
};
}  // namespace ros::message_traits

namespace ros::serialization {
template <>
struct Serializer<lodestone::ros1::SerializedMessage> {
  template <class Stream>
  static void write(Stream& stream, const lodestone::ros1::SerializedMessage& message) {
    if (message.size > 0) std::memcpy(stream.advance(static_cast<std::uint32_t>(message.size)), message.data, message.size);
  }
  static std::uint32_t serializedLength(const lodestone::ros1::SerializedMessage& message) {
    return static_cast<std::uint32_t>(message.size);
  }
};
}  // namespace ros::serialization

namespace lodestone::ros1 {
namespace {

using ConnectionHeader = boost::shared_ptr<ros::M_string>;

rosbag::CompressionType rosbag_compression(Compression compression) {
  switch (compression) {
    case Compression::lz4:
      return rosbag::compression::LZ4;
    case Compression::bz2:
      return rosbag::compression::BZ2;
    case Compression::none:
      break;
  }
  return rosbag::compression::Uncompressed;
}

}  // namespace

struct BagWriter::Implementation {
  std::string path;
  std::string aside;
  std::unique_ptr<rosbag::Bag> bag = std::make_unique<rosbag::Bag>();
  bool is_whole = false;
  std::map<std::tuple<std::string, std::string, bool>, ConnectionHeader> headers;  ///< by topic and publisher

  [[noreturn]] void fail(const std::exception& error) const {
    throw BagError(path + ": cannot write the bag: " + error.what() + "; make room or choose another --out");
  }

  void give_up() {
    try {
      bag->close();
    } catch (const std::exception&) {
      // Where the disk is full its destructor would throw the same once more, and end the program: it is kept for good.
      static auto* const given_up = new std::vector<std::unique_ptr<rosbag::Bag>>;
      given_up->push_back(std::move(bag));
    }
    std::remove(aside.c_str());
  }

  /// As rosbag's recorder writes it.
  ConnectionHeader header_of(const std::string& topic, const SerializedMessage& message, const Publisher& publisher) {
    ConnectionHeader& header = headers[{topic, publisher.name, publisher.latching}];
    if (header == nullptr) {
      header = boost::make_shared<ros::M_string>(ros::M_string{{"topic", topic}, {"type", message.type}, {"md5sum", message.md5},
                                                               {"message_definition", message.definition},
                                                               {"latching", publisher.latching ? "1" : "0"}});
      if (!publisher.name.empty()) (*header)["callerid"] = publisher.name;
    }
    return header;
  }

  template <class Message>
  void write(const std::string& topic, Time record_time, const Message& message, const ConnectionHeader& header = nullptr) {
    try {
      bag->write(topic, to_ros(record_time), message, header);
    } catch (const std::exception& error) {
      fail(error);
    }
  }
};

BagWriter::BagWriter(const std::string& path, Compression compression)
    : implementation_(std::make_unique<Implementation>()) {
  implementation_->path = path;
  implementation_->aside = aside_name(path);
  try {
    implementation_->bag->open(implementation_->aside, rosbag::bagmode::Write);
    implementation_->bag->setCompression(rosbag_compression(compression));
  } catch (const std::exception& error) {
    implementation_->give_up();
    implementation_->fail(error);
  }
}

BagWriter::~BagWriter() {
  if (!implementation_->is_whole) implementation_->give_up();
}

void BagWriter::write(const std::string& topic, Time record_time, const PointCloudMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const std::string& topic, Time record_time, const LivoxMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const std::string& topic, Time record_time, const ImuMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const std::string& topic, Time record_time, const MagneticFieldMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const TopicInfo& topic, Time record_time, const std::uint8_t* data, std::size_t size,
                      const Publisher* publisher) {
  SerializedMessage message{topic.type, topic.md5, topic.definition, data, size};
  // The first generation of Livox' driver writes the same message under its own name.
  if (message.type == "livox_ros_driver/CustomMsg" && message.md5.empty()) message.type = "livox_ros_driver2/CustomMsg";
  if (message.md5.empty() && !describe_as<PointCloudMessage>(message) && !describe_as<LivoxMessage>(message) &&
      !describe_as<ImuMessage>(message) && !describe_as<MagneticFieldMessage>(message)) {
    throw BagError(implementation_->path + ": topic " + topic.name + ": the type " + topic.type + " has no known definition");
  }
  const ConnectionHeader header = publisher == nullptr ? nullptr : implementation_->header_of(topic.name, message, *publisher);
  implementation_->write(topic.name, record_time, message, header);
}

void BagWriter::close() {
  try {
    implementation_->bag->close();
    std::filesystem::rename(implementation_->aside, implementation_->path);
    implementation_->is_whole = true;
  } catch (const std::exception& error) {
    implementation_->fail(error);
  }
}

}  // namespace lodestone::ros1
