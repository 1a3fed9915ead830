// Logs with valid but unusual layouts that no recorder writes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "frontends/messages/wire_ros1.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/stored_messages.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using testing::stored_messages;
using testing::StoredMessage;
using testing::TemporaryFolder;

constexpr Time unusual_start = 1'700'000'000'000'000'000;

/// A header and zeros: 37 for an Imu message, 12 for a MagneticField.
std::vector<std::uint8_t> message_of_numbers(Time stamp, int numbers) {
  Ros1WireWriter writer;
  writer.header(stamp, "sensor");
  for (int i = 0; i < numbers; ++i) writer.number(0.0);
  return writer.take();
}

/// One topic with four publishers: the first and the last send Imu, the second MagneticField, the third an older Imu
/// type.
void write_mixed_bag(const std::string& path) {
  TopicInfo imu, field, older;
  imu.name = field.name = older.name = "/mixed";
  imu.type = older.type = "sensor_msgs/Imu";
  field.type = "sensor_msgs/MagneticField";
  older.md5 = std::string(32, '0');
  older.definition = "Header header\n";
  const Publisher nodes[] = {{"/imu", false}, {"/field", false}, {"/older", false}, {"/again", false}};
  ros1::BagWriter writer(path, Codec::none);
  Time time = unusual_start;
  const auto write = [&](const TopicInfo& topic, int numbers, const Publisher& node) {
    const std::vector<std::uint8_t> bytes = message_of_numbers(++time, numbers);
    writer.write(topic, {time, 0, bytes.data(), bytes.size(), &node});
  };
  for (int i = 0; i < 3; ++i) {
    write(imu, 37, nodes[0]);
    write(field, 12, nodes[1]);
    write(older, 0, nodes[2]);
    write(imu, 37, nodes[3]);
  }
  writer.close();
}

TEST(UnusualBag, OfTwoTypesOnOneTopicTheFirstIsRead) {
  const TemporaryFolder folder;
  write_mixed_bag(folder / "whole.bag");
  std::filesystem::copy_file(folder / "whole.bag", folder / "cut.bag");
  std::filesystem::resize_file(folder / "cut.bag", std::filesystem::file_size(folder / "cut.bag") - 10);
  for (const char* name : {"whole.bag", "cut.bag"}) {
    SCOPED_TRACE(name);
    testing::DecodedLog log(folder / name);
    ASSERT_EQ(log.topics().size(), 1U);
    EXPECT_EQ(log.topic("/mixed").type, "sensor_msgs/Imu");
    EXPECT_EQ(log.topic("/mixed").messages, 6);
    EXPECT_EQ(log.warnings.count("log.mixed_topic"), 2);
    log.select({"/mixed"});
    ros1::Message message;
    std::size_t topic = 0;
    Time time = 0;
    int count = 0;
    for (; log.next(message, topic, time); ++count) {
      ASSERT_TRUE(std::holds_alternative<ros1::ImuMessage>(message));
      EXPECT_EQ(std::get<ros1::ImuMessage>(message).stamp, time);
    }
    EXPECT_EQ(count, 6);
  }
}

/// A bag of three messages; `messages` are the statements that make their table.
std::string write_sqlite(const std::string& path, const std::vector<std::string>& messages) {
  std::filesystem::remove(path);
  const SqliteDatabase database = open_sqlite(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  execute_sqlite(database.get(),
                 "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)");
  execute_sqlite(database.get(), "INSERT INTO topics VALUES (1, '/a', 'a_msgs/msg/A', 'cdr')");
  for (const std::string& each : messages) execute_sqlite(database.get(), each);
  return path;
}

std::vector<std::string> contents_in(const std::string& path) {
  WarningLog warnings;
  const auto source = open_log(path, warnings);
  std::vector<std::string> contents;
  for (const StoredMessage& message : stored_messages(*source)) contents.push_back(message.bytes);
  EXPECT_TRUE(warnings.entries().empty());
  return contents;
}

const std::string three_rows = " VALUES (1, 1, 5, 'first'), (1, 1, 6, 'second'), (1, 1, 7, 'third')";

/// As made by CREATE TABLE ... AS SELECT: `id` is then an ordinary column without an index, and may repeat.
TEST(UnusualSqlite, MessagesAreFoundByTheirRowsAndNotByTheirId) {
  const TemporaryFolder folder;
  const std::string path = write_sqlite(
      folder / "log.db3",
      {"CREATE TABLE messages(id INT, topic_id INT, timestamp INT, data BLOB)", "INSERT INTO messages" + three_rows});
  EXPECT_EQ(contents_in(path), (std::vector<std::string>{"first", "second", "third"}));
}

TEST(UnusualSqlite, WithoutRowidIsReadByItsPrimaryKeyOrRefused) {
  const TemporaryFolder folder;
  const std::string columns = "id INTEGER, topic_id INT, timestamp INT, data BLOB";
  const std::string keyed =
      write_sqlite(folder / "keyed.db3", {"CREATE TABLE messages(" + columns + ", PRIMARY KEY(id)) WITHOUT ROWID",
                                          "INSERT INTO messages VALUES (3, 1, 5, 'a'), (4, 1, 6, 'b')"});
  EXPECT_EQ(contents_in(keyed), (std::vector<std::string>{"a", "b"}));
  const std::string pair = write_sqlite(
      folder / "pair.db3", {"CREATE TABLE messages(" + columns + ", PRIMARY KEY(timestamp, id)) WITHOUT ROWID",
                            "INSERT INTO messages" + three_rows});
  EXPECT_THAT(message_of<InputError>([&] { contents_in(pair); }), HasSubstr("WITHOUT ROWID"));
}

}  // namespace
}  // namespace lodestone
