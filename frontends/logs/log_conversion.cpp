#include "frontends/logs/log_conversion.h"

#include <optional>
#include <utility>

#include "core/error.h"
#include "frontends/logs/latched_messages.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_decoder.h"

namespace lodestone {
namespace {

bool is_convertible(const TopicInfo& topic, Encoding to) {
  const bool known = message_type(topic.type) != MessageType::other;
  if (topic.encoding == Encoding::other) return false;
  if (topic.encoding != to) return known;
  // A ROS 1 bag needs each type's checksum and definition.
  return to == Encoding::cdr || known || (!topic.md5.empty() && !topic.definition.empty());
}

/// Writes a message converted to the writer's ROS.
void write_converted(const std::string& path, const TopicInfo& topic, const RawMessage& message, LogWriter& writer) {
  if (topic.encoding == writer.encoding()) return writer.write(topic, message);
  const std::vector<std::uint8_t> bytes = transcode(path, topic, message, writer.encoding());
  TopicInfo rewritten = topic;
  rewritten.md5.clear();  // checksum, definition and metadata belong to the other ROS
  rewritten.definition.clear();
  rewritten.definition_encoding.clear();
  rewritten.metadata.clear();
  writer.write(rewritten, {message.record_time, message.topic, bytes.data(), bytes.size()});
}

}  // namespace

Conversion convert_log(const std::string& path, MessageSource& source, LogWriter& writer,
                       const std::function<void(Time)>& progress, const LogPart& part) {
  Conversion result;
  std::vector<const TopicInfo*> chosen;
  std::vector<std::string> names;
  for (const TopicInfo& topic : source.topics()) {
    if (!is_convertible(topic, writer.encoding())) {
      result.left_out.push_back(&topic);
      continue;
    }
    chosen.push_back(&topic);
    names.push_back(topic.name);
  }
  if (source.topics().empty()) throw InputError(path + ": the log has no messages");
  if (names.empty()) {
    throw InputError(path +
                     ": no topic has a type that can be converted; expected sensor_msgs/PointCloud2, Imu, "
                     "MagneticField or livox_ros_driver2/CustomMsg");
  }
  source.select(names);
  std::optional<LatchedMessages> latched(std::in_place, chosen);  // collected until the part begins
  const auto begin_part = [&] {
    if (!latched) return;
    for (const RawMessage& message : latched->recorded_at(part.from)) {
      ++result.latched;
      write_converted(path, *chosen[message.topic], message, writer);
    }
    latched->report(path, result.warnings);
    latched.reset();
  };
  for (RawMessage message; source.next(message);) {
    progress(message.record_time);
    if (message.record_time < part.from) {
      if (latched) latched->add(message);
      continue;
    }
    begin_part();
    if (!part.has(message.record_time)) continue;
    ++result.messages;
    write_converted(path, *chosen[message.topic], message, writer);
  }
  begin_part();
  result.messages += result.latched;
  return result;
}

}  // namespace lodestone
