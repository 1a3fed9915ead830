// Invalid record times: their sums and differences must not overflow.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstring>
#include <limits>

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

}  // namespace
}  // namespace lodestone
