#include "frontends/logs/ros1/bag_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/output_file.h"
#include "frontends/logs/ros1/bag_record.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_writing.h"

namespace lodestone::ros1 {
namespace {

constexpr const char* magic = "#ROSBAG V2.0\n";
constexpr std::size_t chunk_bytes = 768 * 1024;  // as in rosbag's recorder
constexpr std::size_t file_header_bytes = 4096;  // with padding for the final values

/// Little-endian bytes of a number.
std::string bytes_of(std::uint64_t value, std::size_t size) {
  std::string bytes(size, '\0');
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(value >> (8 * i));
  return bytes;
}
std::string number(std::uint32_t value) {
  return bytes_of(value, 4);
}
std::string number(std::uint64_t value) {
  return bytes_of(value, 8);
}
std::string operation(BagOperation value) {
  return bytes_of(static_cast<std::uint64_t>(value), 1);
}

/// Seconds, then nanoseconds.
std::string time_bytes(Time time) {
  return bytes_of(static_cast<std::uint64_t>(time / 1'000'000'000), 4) +
         bytes_of(static_cast<std::uint64_t>(time % 1'000'000'000), 4);
}

std::string sized(const std::string& bytes) {
  return number(static_cast<std::uint32_t>(bytes.size())) + bytes;
}

/// Fields in order of name, as in rosbag: "name=value", each after its length.
std::string fields(const std::map<std::string, std::string>& values) {
  std::string bytes;
  for (const auto& [name, value] : values) bytes += sized(name + "=" + value);
  return bytes;
}

std::string record(const std::map<std::string, std::string>& header, const std::string& content) {
  return sized(fields(header)) + sized(content);
}

std::string codec_name(Codec codec) {
  return codec == Codec::lz4 ? "lz4" : codec == Codec::bz2 ? "bz2" : "none";
}

}  // namespace

struct BagWriter::Implementation {
  Implementation(const std::string& path_in, Codec codec_in) : path(path_in), file(path_in), codec(codec_in) {}

  std::string path;
  OutputFile file;
  Codec codec;
  std::uint64_t offset = 0;
  std::map<std::tuple<std::string, std::string, std::string, bool>, std::uint32_t>
      connections;  ///< by topic, type, publisher
  std::string connection_records, chunk_infos;
  std::uint32_t chunks = 0;
  std::string chunk;                             ///< the open chunk
  std::map<std::uint32_t, std::string> indexes;  ///< index of its messages, by connection
  Time chunk_begin = 0, chunk_end = 0;

  void put(const std::string& bytes) {
    file.write(bytes);
    offset += bytes.size();
  }
  std::string file_header(std::uint64_t index_start) const {
    const std::map<std::string, std::string> header{
        {"chunk_count", number(chunks)},
        {"conn_count", number(static_cast<std::uint32_t>(connections.size()))},
        {"index_pos", number(index_start)},
        {"op", operation(BagOperation::file_header)}};
    return record(header, std::string(file_header_bytes - fields(header).size(), ' '));
  }
  void check_time(Time time) const {
    if (time >= 0 && time / 1'000'000'000 <= 0xFFFFFFFFLL) return;
    throw InputError(fmt::format("{}: a stamp of {} ns does not fit ROS time: expected 0 to 2^32 s", path, time));
  }
  std::uint32_t connection_of(const TopicInfo& topic, const Publisher* publisher);
  void end_chunk();
};

/// As in rosbag's recorder, a connection is described in the chunk of its first message and at the end of the file.
std::uint32_t BagWriter::Implementation::connection_of(const TopicInfo& topic, const Publisher* publisher) {
  const auto next = static_cast<std::uint32_t>(connections.size());
  const Publisher sender = publisher != nullptr ? *publisher : Publisher{};
  const auto [entry, is_new] =
      connections.try_emplace({topic.name, topic.type + topic.md5, sender.name, sender.latching}, next);
  if (!is_new) return entry->second;
  std::map<std::string, std::string> description{
      {"md5sum", topic.md5}, {"message_definition", topic.definition}, {"topic", topic.name}, {"type", topic.type}};
  if (publisher != nullptr) description["latching"] = sender.latching ? "1" : "0";
  if (!sender.name.empty()) description["callerid"] = sender.name;
  const std::string bytes =
      record({{"conn", number(next)}, {"op", operation(BagOperation::connection)}, {"topic", topic.name}},
             fields(description));
  chunk += bytes;
  connection_records += bytes;
  return next;
}

void BagWriter::Implementation::end_chunk() {
  if (chunk.empty()) return;
  const std::uint64_t start = offset;
  const std::vector<std::uint8_t> packed =
      pack(codec, {reinterpret_cast<const std::uint8_t*>(chunk.data()), chunk.size()});
  put(record({{"compression", codec_name(codec)},
              {"op", operation(BagOperation::chunk)},
              {"size", number(static_cast<std::uint32_t>(chunk.size()))}},
             std::string(packed.begin(), packed.end())));
  std::string counts;
  for (const auto& [connection, entries] : indexes) {
    const auto count = static_cast<std::uint32_t>(entries.size() / bag_index_entry_bytes);
    put(record({{"conn", number(connection)},
                {"count", number(count)},
                {"op", operation(BagOperation::index)},
                {"ver", number(1U)}},
               entries));
    counts += number(connection) + number(count);
  }
  chunk_infos += record({{"chunk_pos", number(start)},
                         {"count", number(static_cast<std::uint32_t>(indexes.size()))},
                         {"end_time", time_bytes(chunk_end)},
                         {"op", operation(BagOperation::chunk_info)},
                         {"start_time", time_bytes(chunk_begin)},
                         {"ver", number(1U)}},
                        counts);
  ++chunks;
  chunk.clear();
  indexes.clear();
}

BagWriter::BagWriter(const std::string& path, Codec codec)
    : implementation_(std::make_unique<Implementation>(path, codec)) {
  implementation_->put(magic);
  implementation_->put(implementation_->file_header(0));
}

BagWriter::~BagWriter() = default;

template <class Message>
void BagWriter::write(const std::string& topic, Time record_time, const Message& message) {
  implementation_->check_time(message.stamp);
  Ros1WireWriter wire;
  writing::write(wire, message);
  const std::vector<std::uint8_t> bytes = wire.take();
  TopicInfo info;
  info.name = topic;
  info.type = writing::type_of(message);
  write(info, {record_time, 0, bytes.data(), bytes.size(), nullptr});
}

template void BagWriter::write(const std::string&, Time, const PointCloudMessage&);
template void BagWriter::write(const std::string&, Time, const LivoxMessage&);
template void BagWriter::write(const std::string&, Time, const ImuMessage&);
template void BagWriter::write(const std::string&, Time, const MagneticFieldMessage&);
template void BagWriter::write(const std::string&, Time, const OdometryMessage&);

void BagWriter::write(const TopicInfo& topic, const RawMessage& message) {
  Implementation& self = *implementation_;
  const Time record_time = message.record_time;
  self.check_time(record_time);
  TopicInfo described = topic;
  if (described.md5.empty()) {
    const MessageType type = message_type(topic.type);
    if (type == MessageType::other) {
      throw InputError(self.path + ": topic " + topic.name + ": the type " + topic.type +
                       " has no known definition; the bag cannot contain it");
    }
    // Livox' first driver writes the same message under another name.
    if (type == MessageType::livox) described.type = "livox_ros_driver2/CustomMsg";
    described.md5 = expected_md5(type);
    described.definition = ros1_definition(type);
  }
  const bool new_chunk = self.chunk.empty();
  const std::uint32_t connection = self.connection_of(described, message.publisher);
  self.indexes[connection] += time_bytes(record_time) + number(static_cast<std::uint32_t>(self.chunk.size()));
  self.chunk += sized(fields(
      {{"conn", number(connection)}, {"op", operation(BagOperation::message)}, {"time", time_bytes(record_time)}}));
  self.chunk += number(static_cast<std::uint32_t>(message.size));
  self.chunk.append(reinterpret_cast<const char*>(message.data), message.size);
  self.chunk_begin = new_chunk ? record_time : std::min(self.chunk_begin, record_time);
  self.chunk_end = new_chunk ? record_time : std::max(self.chunk_end, record_time);
  if (self.chunk.size() > chunk_bytes) self.end_chunk();
}

void BagWriter::close() {
  Implementation& self = *implementation_;
  self.end_chunk();
  const std::uint64_t index_start = self.offset;
  self.put(self.connection_records);
  self.put(self.chunk_infos);
  self.file.rewrite(static_cast<long>(std::string_view(magic).size()), self.file_header(index_start));
  self.file.commit();
}

}  // namespace lodestone::ros1
