// Logs of other programs: counts are compared with their descriptions, values with each other.
#include <fastcdr/Cdr.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstring>
#include <map>

#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using testing::DecodedLog;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

/// Every message of every topic as bytes: number of messages, and sum of a simple hash.
struct FormatContents {
  std::map<std::string, std::int64_t> counts;
  std::map<std::string, std::uint64_t> hashes;
};

FormatContents contents_of(const std::string& path) {
  WarningLog warnings;
  const auto source = open_log(path, warnings);
  std::vector<std::string> names;
  for (const TopicInfo& topic : source->topics()) names.push_back(topic.name);
  source->select(names);
  FormatContents contents;
  Time previous = 0;
  for (RawMessage message; source->next(message);) {
    EXPECT_GE(message.record_time, previous);
    previous = message.record_time;
    ++contents.counts[names[message.topic]];
    std::uint64_t hash = 14695981039346656037ULL;
    for (std::size_t i = 0; i < message.size; ++i) hash = (hash ^ message.data[i]) * 1099511628211ULL;
    contents.hashes[names[message.topic]] += hash;
  }
  for (const TopicInfo& topic : source->topics()) EXPECT_EQ(topic.messages, contents.counts[topic.name]) << topic.name;
  EXPECT_TRUE(warnings.entries().empty()) << warnings.entries().begin()->second.first_detail;
  return contents;
}

/// All clouds and IMU samples of a log.
struct Measured {
  std::vector<ros1::PointCloudMessage> clouds;
  std::vector<std::vector<std::uint8_t>> points;
  std::vector<ros1::ImuMessage> imu;
  std::vector<ros1::MagneticFieldMessage> fields;
};

Measured measured_in(const std::string& path) {
  DecodedLog log(path);
  std::vector<std::string> names;
  for (const TopicInfo& topic : log.topics()) {
    if (topic.type == "sensor_msgs/PointCloud2" || topic.type == "sensor_msgs/Imu" ||
        topic.type == "sensor_msgs/MagneticField") {
      names.push_back(topic.name);
    }
  }
  log.select(names);
  Measured result;
  ros1::Message message;
  std::size_t topic = 0;
  for (Time time = 0; log.next(message, topic, time);) {
    if (const auto* cloud = std::get_if<ros1::PointCloudMessage>(&message)) {
      result.clouds.push_back(*cloud);
      result.points.emplace_back(cloud->data, cloud->data + cloud->data_size);
    } else if (const auto* imu = std::get_if<ros1::ImuMessage>(&message)) {
      result.imu.push_back(*imu);
    } else if (const auto* field = std::get_if<ros1::MagneticFieldMessage>(&message)) {
      result.fields.push_back(*field);
    }
  }
  return result;
}

TEST(CraftedLog, AViewInATablesPlaceIsRefusedAndNotRun) {
  const std::string topics =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)";
  const std::string endless =
      "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x AS id, 1 AS topic_id, x AS timestamp, "
      "zeroblob(900000000) AS data FROM c";
  const TemporaryFolder folder;
  for (const auto& [name, statement] : std::map<std::string, std::string>{
           {"messages", "CREATE VIEW messages AS " + endless}, {"Messages", "CREATE VIEW Messages AS " + endless}}) {
    const std::string path = folder / (name + ".db3");
    {
      const SqliteDatabase database = open_sqlite(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
      for (const std::string& each : {topics, statement}) execute_sqlite(database.get(), each);
    }
    WarningLog warnings;
    EXPECT_THAT(message_of<InputError>([&] { open_log(path, warnings); }),
                HasSubstr("is not a ROS 2 bag: '" + name + "' is not a table of rows, but a view"));
  }
}

TEST(RealLogs, AnMcapFileOfLibmcapHoldsWhatItsStatisticsSay) {
  LODESTONE_REAL_DATA(path, "bags/nav2_turtlebot.mcap");
  const std::map<std::string, std::int64_t> expected{
      {"/odom", 2639}, {"/tf", 5422}, {"/tf_static", 1}, {"/amcl_pose", 135}};
  EXPECT_EQ(contents_of(path).counts, expected);
  DecodedLog log(path);
  EXPECT_EQ(log.topic("/odom").type, "nav_msgs/Odometry");
  Time begin = log.topics().front().begin, end = log.topics().front().end;
  for (const TopicInfo& topic : log.topics()) {
    begin = std::min(begin, topic.begin);
    end = std::max(end, topic.end);
  }
  EXPECT_EQ(begin, 1778234353382747000);
  EXPECT_EQ(end, 1778234450738043000);
}

TEST(RealLogs, SqliteAndMcapOfOneRecordingHoldTheSame) {
  LODESTONE_REAL_DATA(sqlite, "bags/rosbags-rs-db3");
  LODESTONE_REAL_DATA(mcap, "bags/rosbags-rs-mcap");
  const FormatContents a = contents_of(sqlite);
  const FormatContents b = contents_of(mcap);
  EXPECT_EQ(a.counts, b.counts);
  EXPECT_EQ(a.counts.size(), 94U);
  for (const auto& [topic, count] : a.counts) EXPECT_EQ(count, 2) << topic;
  EXPECT_EQ(a.counts, contents_of(sqlite + "/metadata.yaml").counts);
  EXPECT_EQ(a.counts, contents_of(sqlite + "/test_bag_sqlite3.db3").counts);
  const Measured values = measured_in(sqlite), others = measured_in(mcap);
  ASSERT_EQ(values.imu.size(), 2U);
  ASSERT_EQ(values.fields.size(), 2U);
  EXPECT_EQ(values.imu[0].linear_acceleration, others.imu[0].linear_acceleration);
  EXPECT_EQ(values.fields[1].field_tesla, others.fields[1].field_tesla);
}

TEST(RealLogs, ThreeFormatsOfTheSameScansGiveTheSameBytes) {
  LODESTONE_REAL_DATA(bag, "bags/ouster_os1_128_ros1_bz2.bag");
  LODESTONE_REAL_DATA(mcap, "bags/ouster_os1_128_ros2_mcap");
  LODESTONE_REAL_DATA(sqlite, "bags/ouster_os1_128_ros2_sqlite3");
  const Measured first = measured_in(bag);
  ASSERT_EQ(first.clouds.size(), 3U);
  ASSERT_EQ(first.imu.size(), 30U);
  for (const std::string& path : {mcap, sqlite}) {
    const Measured other = measured_in(path);
    ASSERT_EQ(other.clouds.size(), 3U);
    ASSERT_EQ(other.imu.size(), 30U);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(first.points[i], other.points[i]);
      EXPECT_EQ(first.clouds[i].stamp, other.clouds[i].stamp);
      ASSERT_EQ(first.clouds[i].fields.size(), other.clouds[i].fields.size());
      for (std::size_t k = 0; k < first.clouds[i].fields.size(); ++k) {
        EXPECT_EQ(first.clouds[i].fields[k].name, other.clouds[i].fields[k].name);
        EXPECT_EQ(first.clouds[i].fields[k].offset, other.clouds[i].fields[k].offset);
      }
    }
    for (std::size_t i = 0; i < 30; ++i) {
      EXPECT_EQ(first.imu[i].stamp, other.imu[i].stamp);
      EXPECT_EQ(first.imu[i].angular_velocity, other.imu[i].angular_velocity);
      EXPECT_EQ(first.imu[i].linear_acceleration, other.imu[i].linear_acceleration);
    }
  }
}

TEST(RealLogs, EveryBagIsReadWhole) {
  for (const char* name : {"example.bag", "example-lz4.bag", "example-bz2.bag", "ardrone_imu.bag", "no-messages.bag",
                           "ouster_os1_128_ros1_bz2.bag", "ouster_os1_128_ros2_mcap", "ouster_os1_128_ros2_sqlite3"}) {
    LODESTONE_REAL_DATA(path, std::string("bags/") + name);
    SCOPED_TRACE(name);
    contents_of(path);
  }
}

/// An Imu message in big-endian byte order.
TEST(Cdr, EitherByteOrderIsRead) {
  using eprosima::fastcdr::Cdr;
  for (const auto order : {Cdr::BIG_ENDIANNESS, Cdr::LITTLE_ENDIANNESS}) {
    eprosima::fastcdr::FastBuffer buffer;
    Cdr cdr(buffer, order, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    cdr << std::int32_t{1'700'000'000} << std::uint32_t{123'456'789}
        << std::string("imu_12");  // a size that needs padding
    for (int i = 0; i < 37; ++i) cdr << 0.5 * i;
    const RawMessage raw{5, 0, reinterpret_cast<const std::uint8_t*>(buffer.getBuffer()),
                         cdr.getSerializedDataLength()};
    const TopicInfo topic{"/imu", "sensor_msgs/Imu", Encoding::cdr, 1, 5, 5, "", ""};
    ros1::Message message;
    MessageDecoder("log").decode(topic, raw, message);
    const auto& imu = std::get<ros1::ImuMessage>(message);
    EXPECT_EQ(imu.stamp, 1'700'000'000'123'456'789);
    EXPECT_EQ(imu.frame, "imu_12");
    EXPECT_EQ(imu.angular_velocity, (std::array<double, 3>{6.5, 7.0, 7.5}));
    EXPECT_EQ(imu.linear_acceleration, (std::array<double, 3>{12.5, 13.0, 13.5}));
    RawMessage cut = raw;
    for (cut.size = 0; cut.size < raw.size; ++cut.size) {
      EXPECT_THROW(MessageDecoder("log").decode(topic, cut, message), InputError) << cut.size;
    }
  }
}

TEST(Cdr, PointsOfALivoxAreUnpacked) {
  using eprosima::fastcdr::Cdr;
  for (const auto order : {Cdr::BIG_ENDIANNESS, Cdr::LITTLE_ENDIANNESS}) {
    eprosima::fastcdr::FastBuffer buffer;
    Cdr cdr(buffer, order, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    cdr << std::int32_t{7} << std::uint32_t{8} << std::string("livox") << std::uint64_t{99} << std::uint32_t{3};
    for (int i = 0; i < 4; ++i) cdr << std::uint8_t{0};
    cdr << std::uint32_t{3};
    for (int i = 0; i < 3; ++i) {
      cdr << static_cast<std::uint32_t>(1000 + i) << 1.5F << -2.5F << static_cast<float>(i);
      cdr << std::uint8_t{200} << std::uint8_t{16} << static_cast<std::uint8_t>(i);
    }
    const RawMessage raw{5, 0, reinterpret_cast<const std::uint8_t*>(buffer.getBuffer()),
                         cdr.getSerializedDataLength()};
    const TopicInfo topic{"/livox", "livox_ros_driver2/CustomMsg", Encoding::cdr, 1, 5, 5, "", ""};
    MessageDecoder decoder("log");
    ros1::Message message;
    decoder.decode(topic, raw, message);
    const auto& livox = std::get<ros1::LivoxMessage>(message);
    ASSERT_EQ(livox.data_size, 57U);
    std::uint32_t offset = 0;
    float position[3];
    std::memcpy(&offset, livox.data + 38, 4);
    std::memcpy(position, livox.data + 42, 12);
    EXPECT_EQ(offset, 1002U);
    EXPECT_EQ(position[1], -2.5F);
    EXPECT_EQ(position[2], 2.0F);
    EXPECT_EQ(livox.data[54], 200);
    EXPECT_EQ(livox.data[56], 2);
    // The same after conversion to ROS 1's serialization and back.
    const auto packed = transcode("log", topic, raw, Encoding::ros1);
    const std::vector<std::uint8_t> tail(packed.end() - 57, packed.end());
    EXPECT_EQ(tail, std::vector<std::uint8_t>(livox.data, livox.data + 57));
  }
}

TEST(OpenLog, WarnsOfAFileWithOnlyTheNameOfALog) {
  const TemporaryFolder folder;
  ros1::BagWriter writer(folder / "a.bag", Codec::none);
  ros1::MagneticFieldMessage message;
  message.stamp = 1'000'000'000;
  writer.write("/field", message.stamp, message);
  writer.close();
  WarningLog whole, part;
  open_log(folder.path().string(), whole);
  EXPECT_TRUE(whole.entries().empty());
  testing::write_text(folder / "b.bag", "");
  EXPECT_EQ(open_log(folder.path().string(), part)->topics().size(), 1U);
  ASSERT_EQ(part.entries().count("log.file_passed_over"), 1U);
  EXPECT_THAT(part.entries().at("log.file_passed_over").first_detail,
              HasSubstr("b.bag: has the name of a log, but is none (0 bytes)"));
}

TEST(OpenLog, SaysWhatIsNoLog) {
  const TemporaryFolder folder;
  const auto error = [](const std::string& path) {
    return message_of<InputError>([&] {
      WarningLog warnings;
      open_log(path, warnings);
    });
  };
  EXPECT_THAT(error(folder / "absent"), HasSubstr("there is no such file"));
  EXPECT_THAT(error(folder.path().string()), HasSubstr("the folder has no log"));
  testing::write_text(folder / "text.bag", "just some text, and no bag");
  EXPECT_THAT(error(folder / "text.bag"), HasSubstr("is not a log"));
  testing::write_text(folder / "empty.mcap", "");
  EXPECT_THAT(error(folder / "empty.mcap"), HasSubstr("empty.mcap: the file is empty (0 bytes)"));
  testing::write_text(folder / "metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [a.mcap]\n");
  EXPECT_THAT(error(folder.path().string()), HasSubstr("a.mcap: there is no such file, but"));
  testing::write_text(folder / "metadata.yaml", "version: [");
  EXPECT_THAT(error(folder / "metadata.yaml"), HasSubstr("is not a description of a ROS 2 bag"));
  testing::write_text(folder / "head.db3", "SQLite format 3");
  EXPECT_THAT(error(folder / "head.db3"), HasSubstr("cannot be read as a ROS 2 bag"));
  testing::write_text(folder / "head.mcap", std::string("\x89MCAP0\r\n", 8));
  EXPECT_THAT(error(folder / "head.mcap"), HasSubstr("cut off or damaged at byte 8"));
}

}  // namespace
}  // namespace lodestone
