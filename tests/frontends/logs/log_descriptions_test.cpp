// Descriptions of topics are kept if a log is converted within one ROS version.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "frontends/configuration/text_file.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "tests/frontends/logs/stored_messages.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using testing::raw_message;
using testing::store_as;
using testing::stored_messages;
using testing::StoredMessage;
using testing::TemporaryFolder;
using ::testing::UnorderedElementsAre;

constexpr Time described_start = 1'700'000'000'000'000'000;

/// A latched topic of ROS 2, whose type is defined in IDL.
TopicInfo latched_topic() {
  TopicInfo topic;
  topic.name = "/tf_static";
  topic.type = "tf2_msgs/TFMessage";
  topic.encoding = Encoding::cdr;
  topic.definition = "IDL: tf2_msgs/msg/TFMessage\nmodule tf2_msgs { };\n";
  topic.definition_encoding = "ros2idl";
  topic.metadata = {{"offered_qos_profiles", "- history: keep_last\n  depth: 1\n  durability: transient_local\n"},
                    {"topic_type_hash", "RIHS01_0123"}};
  return topic;
}

void write_latched(const std::string& path, LogFormat format) {
  const auto writer = make_log_writer(path, format, Codec::none);
  writer->write(latched_topic(), raw_message(described_start, std::string("\0\1\0\0", 4)));
  writer->close();
}

TEST(LogDescriptions, OfRos2StayWhatTheyAre) {
  const TemporaryFolder folder;
  for (const LogFormat from : {LogFormat::mcap, LogFormat::db3}) {
    for (const LogFormat to : {LogFormat::mcap, LogFormat::db3}) {
      write_latched(folder / "from", from);
      store_as(folder / "from", folder / "to", to);
      for (const char* name : {"from", "to"}) {
        SCOPED_TRACE(name);
        WarningLog warnings;
        const auto log = open_log(folder / name, warnings);
        ASSERT_EQ(log->topics().size(), 1U);
        const TopicInfo& topic = log->topics().front();
        EXPECT_EQ(topic.definition, latched_topic().definition);
        EXPECT_EQ(topic.definition_encoding, "ros2idl");
        EXPECT_EQ(topic.metadata, latched_topic().metadata);
        EXPECT_EQ(stored_messages(*log).size(), 1U);
      }
    }
  }
}

/// Column names are those of rosbag2's schema 4.
TEST(LogDescriptions, OfAnSqliteBagStandWhereRosbag2LooksForThem) {
  const TemporaryFolder folder;
  write_latched(folder / "log.db3", LogFormat::db3);
  const SqliteDatabase database = open_sqlite(folder / "log.db3", SQLITE_OPEN_READONLY);
  SqliteStatement topics(database.get(), "SELECT offered_qos_profiles, type_description_hash FROM topics");
  ASSERT_TRUE(topics.step());
  EXPECT_THAT(topics.text(0), HasSubstr("durability: transient_local"));
  EXPECT_EQ(topics.text(1), "RIHS01_0123");
  SqliteStatement definitions(database.get(), "SELECT encoding, encoded_message_definition FROM message_definitions");
  ASSERT_TRUE(definitions.step());
  EXPECT_EQ(definitions.text(0), "ros2idl");
  EXPECT_THAT(definitions.text(1), HasSubstr("IDL: tf2_msgs"));
}

/// Older bags have neither these columns nor the table.
TEST(LogDescriptions, MayBeMissingInAnSqliteBag) {
  const TemporaryFolder folder;
  {
    const SqliteDatabase database = open_sqlite(folder / "log.db3", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    for (const char* each :
         {"CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)",
          "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)",
          "CREATE TABLE message_definitions(topic_type TEXT, encoded_message_definition TEXT)",
          "INSERT INTO topics VALUES (1, '/a', 'a_msgs/msg/A', 'cdr')",
          "INSERT INTO message_definitions VALUES ('a_msgs/msg/A', 'float64 x')",
          "INSERT INTO messages VALUES (1, 1, 5, x'0001')"}) {
      execute_sqlite(database.get(), each);
    }
  }
  WarningLog warnings;
  const auto log = open_log(folder / "log.db3", warnings);
  ASSERT_EQ(log->topics().size(), 1U);
  EXPECT_EQ(log->topics().front().definition, "float64 x");
  EXPECT_EQ(log->topics().front().definition_encoding, "");
  EXPECT_TRUE(log->topics().front().metadata.empty());
  EXPECT_TRUE(warnings.entries().empty());
}

/// Two nodes latch messages on one topic: each must keep its own connection.
TEST(LogDescriptions, OfRos1KeepEachPublisher) {
  const TemporaryFolder folder;
  const Publisher first{"/first", true}, second{"/second", true}, plain{"/plain", false};
  {
    TopicInfo topic;
    topic.name = "/tf_static";
    topic.type = "tf2_msgs/TFMessage";
    topic.md5 = "94810edda583a504dfda3829e70d7eec";
    topic.definition = "geometry_msgs/TransformStamped[] transforms\n";
    TopicInfo other = topic;
    other.name = "/tf";
    ros1::BagWriter writer(folder / "log.bag", Codec::none);
    const std::vector<std::uint8_t> bytes(4);
    Time time = described_start;
    for (const Publisher* publisher : {&first, &second, &first})
      writer.write(topic, {++time, 0, bytes.data(), bytes.size(), publisher});
    writer.write(other, {++time, 0, bytes.data(), bytes.size(), &plain});
    writer.write(other, {++time, 0, bytes.data(), bytes.size()});
    writer.close();
  }
  const std::string content = read_text_file(folder / "log.bag");
  for (const char* field : {"latching=1", "callerid=/first", "callerid=/second", "latching=0"}) {
    EXPECT_THAT(content, HasSubstr(field));
  }
  const auto publishers_in = [&](const std::string& name) {
    WarningLog warnings;
    std::vector<std::string> publishers;
    const auto log = open_log(folder / name, warnings);
    for (const StoredMessage& message : stored_messages(*log)) publishers.push_back(message.publisher);
    EXPECT_EQ(warnings.count("log.mixed_topic"), 0);
    return publishers;
  };
  const std::vector<std::string> expected{"/first latching", "/second latching", "/first latching", "/plain", ""};
  EXPECT_EQ(publishers_in("log.bag"), expected);
  store_as(folder / "log.bag", folder / "again.bag", LogFormat::rosbag, Codec::lz4);
  EXPECT_EQ(publishers_in("again.bag"), expected);
  // Also for a bag without an end, which is read in another way.
  std::filesystem::resize_file(folder / "log.bag", std::filesystem::file_size(folder / "log.bag") - 10);
  EXPECT_EQ(publishers_in("log.bag"), expected);
}

/// Result of store_as() for the part from `from` on.
Conversion store_part(const std::string& from_file, const std::string& to_file, LogFormat format, Time from) {
  WarningLog warnings;
  const auto source = open_log(from_file, warnings);
  const auto writer = make_log_writer(to_file, format, Codec::none);
  Conversion conversion = convert_log(from_file, *source, *writer, [](Time) {}, {.from = from});
  writer->close();
  conversion.left_out.clear();  // they refer to the source, which is destroyed here
  return conversion;
}

std::vector<StoredMessage> all_messages_in(const std::string& path) {
  WarningLog warnings;
  const auto log = open_log(path, warnings);
  return stored_messages(*log);
}

/// For two nodes that latch: the last message of each. For a node that does not latch: none.
TEST(LogDescriptions, APartOfRos1BeginsWithWhatWasLatched) {
  const TemporaryFolder folder;
  const Publisher first{"/first", true}, second{"/second", true}, plain{"/plain", false};
  TopicInfo fixed, moving;
  fixed.name = "/tf_static";
  fixed.type = "tf2_msgs/TFMessage";
  fixed.md5 = "94810edda583a504dfda3829e70d7eec";
  fixed.definition = "geometry_msgs/TransformStamped[] transforms\n";
  moving = fixed;
  moving.name = "/tf";
  struct Sent {
    const TopicInfo* topic;
    const Publisher* publisher;
    std::string bytes;
  };
  const std::vector<Sent> sent{{&fixed, &first, "old1"}, {&fixed, &second, "two_"}, {&moving, &plain, "away"},
                               {&fixed, &first, "one_"}, {&fixed, &plain, "away"},  {&moving, &plain, "here"},
                               {&fixed, &first, "new1"}};
  {
    ros1::BagWriter writer(folder / "log.bag", Codec::none);
    Time time = described_start;
    for (const Sent& each : sent) {
      writer.write(*each.topic, {++time, 0, reinterpret_cast<const std::uint8_t*>(each.bytes.data()), each.bytes.size(),
                                 each.publisher});
    }
    writer.close();
  }
  const Time from = described_start + 6;
  const Conversion conversion = store_part(folder / "log.bag", folder / "part.bag", LogFormat::rosbag, from);
  EXPECT_EQ(conversion.messages, 4);
  EXPECT_EQ(conversion.latched, 2);
  EXPECT_TRUE(conversion.warnings.entries().empty());
  const std::vector<StoredMessage> messages = all_messages_in(folder / "part.bag");
  EXPECT_THAT(messages, UnorderedElementsAre(StoredMessage{"/tf_static", from, "two_", "/second latching"},
                                             StoredMessage{"/tf_static", from, "one_", "/first latching"},
                                             StoredMessage{"/tf", from, "here", "/plain"},
                                             StoredMessage{"/tf_static", from + 1, "new1", "/first latching"}));
  // In a conversion of the whole log, no message appears twice.
  EXPECT_EQ(store_part(folder / "log.bag", folder / "whole.bag", LogFormat::rosbag, described_start).messages, 7);
  // If the log is a folder of parts, the node of one part is that of the next part.
  std::filesystem::create_directory(folder / "parts");
  std::filesystem::rename(folder / "log.bag", folder / "parts/0.bag");
  {
    ros1::BagWriter writer(folder / "parts/1.bag", Codec::none);
    const std::vector<std::uint8_t> bytes(4);
    for (const Time after : {8, 9})
      writer.write(fixed, {described_start + after, 0, bytes.data(), bytes.size(), &first});
    writer.close();
  }
  EXPECT_EQ(store_part(folder / "parts", folder / "part.bag", LogFormat::rosbag, described_start + 9).latched, 2);
}

/// Each message of a latched topic may be from another node.
TEST(LogDescriptions, APartOfRos2BeginsWithWhatWasLatched) {
  const TemporaryFolder folder;
  for (const std::string durability : {"transient_local", "1", "volatile", "2"}) {
    for (const LogFormat format : {LogFormat::mcap, LogFormat::db3}) {
      SCOPED_TRACE(durability);
      const bool latches = durability == "transient_local" || durability == "1";
      TopicInfo topic = latched_topic(), map = latched_topic(), other = latched_topic();
      topic.metadata["offered_qos_profiles"] =
          "- history: keep_last\n  durability: volatile\n- depth: 1\n  durability: " + durability + "\n  x: 1\n";
      map.name = "/map";
      map.type = "sensor_msgs/PointCloud2";
      map.metadata = topic.metadata;
      other.name = "/tf";
      other.metadata.clear();
      const auto writer = make_log_writer(folder / "log", format, Codec::none);
      Time time = described_start;
      for (const TopicInfo* each : {&topic, &other, &map, &map, &topic, &other}) {
        writer->write(*each, raw_message(time, std::string("\0\1\0\0", 4) + std::to_string(time - described_start)));
        ++time;
      }
      writer->close();
      const Conversion conversion = store_part(folder / "log", folder / "part", format, described_start + 5);
      EXPECT_EQ(conversion.latched, latches ? 3 : 0);
      const std::vector<StoredMessage> messages = all_messages_in(folder / "part");
      ASSERT_EQ(messages.size(), latches ? 4U : 1U);
      std::string order;
      for (const StoredMessage& message : messages) {
        EXPECT_EQ(message.time, described_start + 5);
        order += message.bytes.back();
      }
      EXPECT_EQ(order, latches ? "0345" : "5");
    }
  }
}

TEST(LogDescriptions, APartBeginsWithSoMuchOfWhatWasLatched) {
  const TemporaryFolder folder;
  const auto writer = make_log_writer(folder / "log.mcap", LogFormat::mcap, Codec::zstd);
  TopicInfo large = latched_topic();
  large.name = "/map";
  const std::string small("\0\1\0\0", 4), megabytes = small + std::string(std::size_t{30} << 20, 'x');
  for (int i = 0; i < 130; ++i) writer->write(latched_topic(), raw_message(described_start + i, small));
  for (int i = 130; i < 133; ++i) writer->write(large, raw_message(described_start + i, megabytes));
  writer->write(latched_topic(), raw_message(described_start + 200, small));
  writer->close();
  const Conversion conversion =
      store_part(folder / "log.mcap", folder / "part.mcap", LogFormat::mcap, described_start + 200);
  EXPECT_EQ(conversion.latched, 100 + 2);
  EXPECT_EQ(conversion.messages, 100 + 2 + 1);
  EXPECT_EQ(conversion.warnings.count("log.latched_left_out"), 30 + 1);
}

}  // namespace
}  // namespace lodestone
