// What a log says of its topics beside their messages stays with them when it is converted within one ROS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sqlite3.h>

#include "frontends/readers/ros1/bag_writer.h"
#include "frontends/readers/ros2/sqlite_handle.h"
#include "frontends/readers/text_file.h"
#include "tests/frontends/readers/stored_messages.h"
#include "tests/frontends/readers/test_files.h"

namespace lodestone {
namespace {

using testing::raw_message;
using testing::store_as;
using testing::stored_messages;
using testing::StoredMessage;
using testing::TemporaryFolder;
using ::testing::HasSubstr;

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

/// As rosbag2's schema 4 names the columns.
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

/// Older bags have neither the columns nor the table.
TEST(LogDescriptions, MayBeMissingInAnSqliteBag) {
  const TemporaryFolder folder;
  {
    const SqliteDatabase database = open_sqlite(folder / "log.db3", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    for (const char* each : {"CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)",
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

/// Two nodes latch on one topic, so that each must keep a connection of its own.
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
    ros1::BagWriter writer(folder / "log.bag", ros1::Compression::none);
    const std::vector<std::uint8_t> bytes(4);
    Time time = described_start;
    for (const Publisher* publisher : {&first, &second, &first}) writer.write(topic, ++time, bytes.data(), bytes.size(), publisher);
    writer.write(other, ++time, bytes.data(), bytes.size(), &plain);
    writer.write(other, ++time, bytes.data(), bytes.size());
    writer.close();
  }
  const std::string content = read_text_file(folder / "log.bag");
  for (const char* said : {"latching=1", "callerid=/first", "callerid=/second", "latching=0"}) {
    EXPECT_THAT(content, HasSubstr(said));
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
  // Also of a bag without an end, which is read another way.
  std::filesystem::resize_file(folder / "log.bag", std::filesystem::file_size(folder / "log.bag") - 10);
  EXPECT_EQ(publishers_in("log.bag"), expected);
}

}  // namespace
}  // namespace lodestone
