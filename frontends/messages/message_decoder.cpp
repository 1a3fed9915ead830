#include "frontends/messages/message_decoder.h"

#include <fmt/format.h>

#include "core/error.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_reading.h"
#include "frontends/messages/transcoding.h"
#include "frontends/messages/with_reader.h"

namespace lodestone {
namespace {

MessageType checked_type(const std::string& source, const TopicInfo& topic) {
  const MessageType type = message_type(topic.type);
  if (type == MessageType::other || topic.encoding == Encoding::other) {
    throw InputError(
        fmt::format("{}: topic {} is a {}{}; expected sensor_msgs/PointCloud2, Imu or MagneticField, "
                    "nav_msgs/Odometry or livox_ros_driver2/CustomMsg, of ROS 1 or ROS 2",
                    source, topic.name, topic.type.empty() ? "message without a type" : topic.type,
                    topic.encoding == Encoding::other ? " in an encoding of neither ROS 1 nor ROS 2" : ""));
  }
  if (!topic.md5.empty() && topic.md5 != "*" && topic.md5 != expected_md5(type)) {
    throw InputError(fmt::format("{}: topic {} has a {} of another version (MD5 {}); expected that of {}", source,
                                 topic.name, topic.type, topic.md5,
                                 type == MessageType::livox ? "livox_ros_driver2" : "ROS Noetic"));
  }
  return type;
}

template <class Plain>
Plain& as(ros1::Message& message) {
  if (!std::holds_alternative<Plain>(message)) message.emplace<Plain>();
  return std::get<Plain>(message);
}

template <class Writer>
std::vector<std::uint8_t> written(const std::string& source, const TopicInfo& topic, const RawMessage& raw,
                                  MessageType type) {
  Writer writer;
  with_reader(source, topic, raw, [&](auto& wire) { transcoding::copy(type, wire, writer); });
  return writer.take();
}

}  // namespace

void MessageDecoder::decode(const TopicInfo& topic, const RawMessage& raw, ros1::Message& message) {
  const MessageType type = checked_type(source_, topic);
  with_reader(source_, topic, raw, [&](auto& wire) {
    switch (type) {
      case MessageType::point_cloud:
        return reading::read(wire, as<ros1::PointCloudMessage>(message), points_);
      case MessageType::livox:
        return reading::read_livox(wire, as<ros1::LivoxMessage>(message), points_, topic.encoding == Encoding::cdr);
      case MessageType::imu:
        return reading::read(wire, as<ros1::ImuMessage>(message), points_);
      case MessageType::odometry:
        return reading::read(wire, as<ros1::OdometryMessage>(message), points_);
      default:
        return reading::read(wire, as<ros1::MagneticFieldMessage>(message), points_);
    }
  });
}

std::vector<std::uint8_t> transcode(const std::string& source, const TopicInfo& topic, const RawMessage& raw,
                                    Encoding to) {
  const MessageType type = checked_type(source, topic);
  return to == Encoding::cdr ? written<CdrWireWriter>(source, topic, raw, type)
                             : written<Ros1WireWriter>(source, topic, raw, type);
}

}  // namespace lodestone
