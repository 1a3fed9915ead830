// Invalid record times: their sums and differences must not overflow.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstring>
#include <limits>

#include "frontends/logs/isolated_times.h"
#include "frontends/logs/mcap/mcap_records.h"
#include "frontends/logs/open_log.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

TEST(RecordTimes, OfMcapAreAtMostTheFarthest) {
  const auto read = [](std::uint64_t nanoseconds) {
    std::uint8_t bytes[8];
    for (int i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(nanoseconds >> (8 * i));
    return mcap::RecordCursor(bytes).time();
  };
  EXPECT_EQ(read(1'700'000'000'000'000'001), 1'700'000'000'000'000'001);
  EXPECT_EQ(read(std::numeric_limits<Time>::max()), farthest_time);
}

TEST(RecordTimes, OfSqliteAreAtMostTheFarthest) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "log.db3";
  {
    const SqliteDatabase database = open_sqlite(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    for (const char* statement :
         {"CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)",
          "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)",
          "INSERT INTO topics VALUES(1, '/imu', 'sensor_msgs/msg/Imu', 'cdr')",
          "INSERT INTO messages VALUES(1, 1, 5, x'00010000')",
          "INSERT INTO messages VALUES(2, 1, 9223372036854775807, x'00010000')",
          "INSERT INTO messages VALUES(3, 1, -9223372036854775808, x'00010000')"}) {
      execute_sqlite(database.get(), statement);
    }
  }
  WarningLog warnings;
  const auto log = open_log(path, warnings);
  log->select({"/imu"});
  RawMessage message;
  std::vector<Time> times;
  while (log->next(message)) times.push_back(message.record_time);
  EXPECT_EQ(times, (std::vector<Time>{-farthest_time, 5, farthest_time}));
  EXPECT_EQ(log->topics().front().begin, -farthest_time);
}

TEST(RecordTimes, ADamagedTimeOfSqliteIsReplacedAndReported) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "log.db3";
  constexpr Time begin = 1'700'000'000'000'000'000;
  {
    const SqliteDatabase database = open_sqlite(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    for (const char* statement :
         {"CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)",
          "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)",
          "INSERT INTO topics VALUES(1, '/imu', 'sensor_msgs/msg/Imu', 'cdr')"}) {
      execute_sqlite(database.get(), statement);
    }
    for (int i = 0; i < 100; ++i) {
      const Time flipped = i == 50 ? Time{1} << 48 : 0;  // one bit: 281,475 s
      execute_sqlite(database.get(), "INSERT INTO messages VALUES(" + std::to_string(i) + ", 1, " +
                                         std::to_string((begin + i * 10'000'000LL) ^ flipped) + ", x'00010000')");
    }
  }
  WarningLog warnings;
  const auto log = open_log(path, warnings);
  EXPECT_EQ(log->topics().front().begin, begin);
  EXPECT_EQ(log->topics().front().end, begin + 99 * 10'000'000LL);
  ASSERT_EQ(warnings.count("log.record_time"), 1);
  EXPECT_EQ(warnings.entries().at("log.record_time").first_detail,
            path +
                ": message 50 has a record time that is 281475 s away from those written before and after; the time "
                "of its neighbour is used");
  log->select({"/imu"});
  Time last = begin;
  int messages = 0;
  for (RawMessage message; log->next(message); ++messages) {
    EXPECT_GE(message.record_time, last);
    last = message.record_time;
  }
  EXPECT_EQ(messages, 100);
}

TEST(RecordTimes, PausesAndJumpsOfTheClockAreNotDamage) {
  constexpr Time second = 1'000'000'000;
  const std::vector<Time> paused{0, 1 * second, 200 * second, 201 * second, 202 * second};
  EXPECT_TRUE(isolated_times(paused).empty());
  const std::vector<Time> jumped{0, 1 * second, 100'000 * second, 100'001 * second, 3 * second, 4 * second};
  EXPECT_TRUE(isolated_times(jumped).empty());
  const std::vector<Time> sparse{0, 100 * second, 200 * second, 300 * second};
  EXPECT_TRUE(isolated_times(sparse).empty());
  const std::vector<Time> damaged{200'000 * second, 1 * second, 2 * second, 500 * second, 3 * second, 4 * second};
  EXPECT_EQ(isolated_times(damaged), (std::vector<std::size_t>{0, 3}));
}

}  // namespace
}  // namespace lodestone
