// Logs written in every format: the content is unchanged by conversion, also of files that are cut off or altered.
#include "frontends/logs/log_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <random>

#include "frontends/configuration/text_file.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::message_of;
using ::testing::StartsWith;
using testing::SyntheticLog;
using testing::TemporaryFolder;

void convert(const std::string& from, const std::string& to, LogFormat format, Codec codec) {
  WarningLog warnings;
  const auto source = open_log(from, warnings);
  const auto writer = make_log_writer(to, format, codec);
  convert_log(from, *source, *writer, [](Time) {});
  EXPECT_FALSE(fs::exists(to)) << "the log must not carry its name before it is whole";
  writer->close();
}

/// Every measurement of a log as text, exact to the bit.
struct Reading {
  std::vector<std::string> lines;
  WarningLog warnings;
};

Reading read(const std::string& path, const Platform& platform) {
  Reading reading;
  BagSource source(path, platform, reading.warnings);
  const auto bits = [](const auto& value) { return std::string(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (Measurement measurement; source.next(measurement);) {
    std::string line;
    if (const auto* imu = std::get_if<ImuSample>(&measurement)) {
      line = "imu" + bits(imu->time) + bits(imu->angular_velocity) + bits(imu->linear_acceleration);
    } else if (const auto* field = std::get_if<MagneticSample>(&measurement)) {
      line = "field" + bits(field->time) + bits(field->magnetometer) + bits(field->field_ut);
    } else {
      const auto& scan = std::get<LidarScan>(measurement);
      line = "scan" + bits(scan.start) + bits(scan.end);
      for (const LidarPoint& point : scan.points) {
        line += bits(point.position) + bits(point.intensity) + bits(point.offset_ns) + bits(point.ring);
      }
    }
    reading.lines.push_back(std::move(line));
  }
  return reading;
}

std::vector<std::string> sorted(std::vector<std::string> lines) {
  std::sort(lines.begin(), lines.end());
  return lines;
}

struct Kind {
  LogFormat format;
  Codec codec;
  const char* name;
};

class EachFormat : public ::testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    log.scans = 6;
    log.points_per_scan = 512;
    log.write(folder / "log.bag");
    convert(folder / "log.bag", path, GetParam().format, GetParam().codec);
  }
  void write_bytes(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }

  TemporaryFolder folder;
  SyntheticLog log;
  std::string path = folder / "log";  // without an ending: the content determines the format
};

TEST_P(EachFormat, GivesTheSameMeasurementsBitByBit) {
  const Reading before = read(folder / "log.bag", log.platform());
  const Reading after = read(path, log.platform());
  EXPECT_EQ(before.lines.size(), 6U + 125U + 2U * 63U);
  EXPECT_TRUE(before.lines == after.lines);
  EXPECT_TRUE(after.warnings.entries().empty());
  convert(path, folder / "back.bag", LogFormat::rosbag, Codec::lz4);
  EXPECT_TRUE(sorted(before.lines) == sorted(read(folder / "back.bag", log.platform()).lines));
}

/// With any bytes altered or missing, a log is either read, or refused in one line; no other exception is thrown.
TEST_P(EachFormat, SurvivesAlteredBytes) {
  const std::string bytes = read_text_file(path);
  std::mt19937_64 random(20 + static_cast<unsigned>(GetParam().codec));
  int refused = 0, whole = 0;
  for (int round = 0; round < 200; ++round) {
    std::string altered = bytes;
    const int changes = 1 + static_cast<int>(random() % 8);
    for (int i = 0; i < changes; ++i) {
      // Half of the changes are in the first and last kilobyte, which contain most lengths and offsets.
      std::size_t at = random() % altered.size();
      if (random() % 2 == 0) at = random() % 2 == 0 ? at % 1024 : altered.size() - 1 - at % 1024;
      const std::size_t length = std::min<std::size_t>(random() % 5 == 0 ? 8 : 1, altered.size() - at);
      for (std::size_t k = 0; k < length; ++k) altered[at + k] = static_cast<char>(random() % 3 == 0 ? 0xFF : random());
    }
    if (random() % 10 == 0) altered.resize(random() % altered.size());
    write_bytes("altered", altered);
    try {
      whole += read(folder / "altered", log.platform()).warnings.entries().empty() ? 1 : 0;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      EXPECT_THAT(error.what(), HasSubstr("altered")) << "the file must be named";
      ++refused;
    }
  }
  EXPECT_GT(refused, 10);
  RecordProperty("refused", refused);
  RecordProperty("without_warning", whole);
}

TEST_P(EachFormat, ACutOffLogOfRos2GivesWhatItHolds) {
  if (GetParam().format == LogFormat::rosbag) GTEST_SKIP() << "ROS 1 bags need their index";
  const std::string bytes = read_text_file(path);
  const std::size_t all = read(path, log.platform()).lines.size();
  std::size_t previous = 0;
  for (const double share : {0.6, 0.9, 0.99}) {
    SCOPED_TRACE(share);
    write_bytes("cut", bytes.substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes.size()))));
    WarningLog warnings;
    const auto source = open_log(folder / "cut", warnings);
    std::vector<std::string> names;
    for (const TopicInfo& topic : source->topics()) names.push_back(topic.name);
    source->select(names);
    std::size_t count = 0;
    for (RawMessage message; source->next(message);) ++count;
    EXPECT_GE(warnings.count("log.cut_off"), 1);
    EXPECT_GE(count, previous);
    EXPECT_LE(count, all);
    if (share > 0.8) {
      EXPECT_GT(count, all / 3);
    }
    previous = count;
  }
}

TEST_P(EachFormat, PartsOfOneRecordingAreOneLog) {
  fs::create_directories(folder.path() / "split");
  SyntheticLog second = log;
  second.start = log.start + 6 * SyntheticLog::period + 20'000'000 + SyntheticLog::imu_period;
  second.write(folder / "second.bag");
  convert(folder / "log.bag", folder / "split/b_first", GetParam().format, GetParam().codec);
  convert(folder / "second.bag", folder / "split/a_second", GetParam().format, GetParam().codec);
  const std::size_t half = read(path, log.platform()).lines.size();
  EXPECT_EQ(read(folder / "split", log.platform()).lines.size(), 2 * half);  // in the order of time, not of names
  testing::write_text(folder / "split/metadata.yaml",
                      "rosbag2_bagfile_information:\n  relative_file_paths: [b_first, a_second]\n");
  const Reading both = read(folder / "split", log.platform());
  EXPECT_EQ(both.lines.size(), 2 * half);
  EXPECT_TRUE(both.warnings.entries().empty());
  testing::write_text(folder / "split/metadata.yaml",
                      "rosbag2_bagfile_information:\n  relative_file_paths: [b_first]\n");
  EXPECT_EQ(read(folder / "split", log.platform()).lines.size(), half);
}

TEST_P(EachFormat, RecordingsOfOneTimeAreNoOneLog) {
  fs::create_directories(folder.path() / "two");
  SyntheticLog second = log;
  second.start = log.start + SyntheticLog::period;
  second.write(folder / "second.bag");
  convert(folder / "log.bag", folder / "two/log", GetParam().format, GetParam().codec);
  convert(folder / "second.bag", folder / "two/survey", GetParam().format, GetParam().codec);
  const auto refusal = [&] { return message_of<InputError>([&] { read(folder / "two", log.platform()); }); };
  const std::string two = folder / "two";
  EXPECT_THAT(refusal(), AllOf(StartsWith(two + ": log and survey both have /"),
                               EndsWith("use one of them, " + two + "/log or " + two + "/survey")));
  // With metadata.yaml, the files count as one recording.
  testing::write_text(folder / "two/metadata.yaml",
                      "rosbag2_bagfile_information:\n  relative_file_paths: [log, survey]\n");
  EXPECT_GT(read(folder / "two", log.platform()).lines.size(), read(path, log.platform()).lines.size());
  // Logs of another format with the same topics are always refused.
  const bool is_bag = GetParam().format == LogFormat::rosbag;
  fs::remove(two + "/survey");
  convert(folder / "second.bag", two + "/survey", is_bag ? LogFormat::mcap : LogFormat::rosbag, Codec::none);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(is_bag ? "of ROS 1 in log and" : "of ROS 2 in log and"),
                               HasSubstr(is_bag ? "of ROS 2 in survey:" : "of ROS 1 in survey:"),
                               EndsWith("use one of them, " + two + "/log or " + two + "/survey")));
}

TEST_P(EachFormat, IsReadWhenPackedAsAWhole) {
  const std::string bytes = read_text_file(path);
  const auto packed = pack(Codec::zstd, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  write_bytes("packed", std::string(packed.begin(), packed.end()));
  EXPECT_TRUE(read(folder / "packed", log.platform()).lines == read(path, log.platform()).lines);
}

INSTANTIATE_TEST_SUITE_P(
    Logs, EachFormat,
    ::testing::Values(Kind{LogFormat::rosbag, Codec::none, "bag_none"}, Kind{LogFormat::rosbag, Codec::lz4, "bag_lz4"},
                      Kind{LogFormat::mcap, Codec::none, "mcap_none"}, Kind{LogFormat::mcap, Codec::lz4, "mcap_lz4"},
                      Kind{LogFormat::mcap, Codec::zstd, "mcap_zstd"}, Kind{LogFormat::db3, Codec::none, "db3_none"},
                      Kind{LogFormat::db3, Codec::zstd, "db3_zstd"}),
    [](const auto& info) { return std::string(info.param.name); });

/// All fields are converted in both directions, also those that Lodestone does not use.
TEST(Conversion, KeepsEveryByteOfRealMessages) {
  LODESTONE_REAL_DATA(bag, "bags/ardrone_imu.bag");
  const TemporaryFolder folder;
  convert(bag, folder / "a.mcap", LogFormat::mcap, Codec::zstd);
  convert(folder / "a.mcap", folder / "b.bag", LogFormat::rosbag, Codec::none);
  WarningLog warnings;
  const auto before = open_log(bag, warnings), after = open_log(folder / "b.bag", warnings);
  std::vector<std::string> names;
  for (const TopicInfo& topic : after->topics()) names.push_back(topic.name);
  ASSERT_EQ(names.size(), 2U);
  before->select(names);
  after->select(names);
  std::map<std::size_t, std::vector<std::string>> a, b;
  const auto collect = [](MessageSource& source, auto& into) {
    // The first four bytes are ROS 1's sequence number, which does not exist in ROS 2.
    for (RawMessage m; source.next(m);) into[m.topic].emplace_back(m.data + 4, m.data + m.size);
  };
  collect(*before, a);
  collect(*after, b);
  EXPECT_GT(a[0].size(), 1000U);
  EXPECT_TRUE(a == b);
}

TEST(CsvLog, GivesWhatItsFilesSay) {
  const TemporaryFolder folder;
  fs::create_directories(folder.path() / "log/lidar/points");
  testing::write_text(folder / "log/imu.csv",
                      "time_s,gyroscope_x_rad_s,gyroscope_y_rad_s,gyroscope_z_rad_s,accelerometer_x_m_s2,"
                      "accelerometer_y_m_s2,accelerometer_z_m_s2,temperature\n"
                      "1700000000.000000001,0.1,0.2,0.3,1,2,9.5,20\n1700000000.005,0,0,-1e-3,0,0,9.8,20\n17000");
  testing::write_text(folder / "log/array_0.csv",
                      "field_z_ut; time_ns; field_x_ut; field_y_ut\r\n-40; 1700000000002000000; 20; 1.5\r\n");
  testing::write_text(folder / "log/lidar/points/1700000000.001.pcd",
                      "VERSION 0.7\nFIELDS x y z t\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
                      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 0\n4 5 6 50000000\n");
  testing::DecodedLog log(folder / "log");
  ASSERT_EQ(log.topics().size(), 3U);
  EXPECT_EQ(log.warnings.count("log.cut_off"), 1);
  EXPECT_EQ(log.topic("/imu").messages, 2);
  log.select({"/imu", "/array_0", "/lidar/points"});
  ros1::Message message;
  std::size_t topic = 0;
  Time time = 0;
  ASSERT_TRUE(log.next(message, topic, time));
  EXPECT_EQ(time, 1'700'000'000'000'000'001);
  EXPECT_EQ(std::get<ros1::ImuMessage>(message).stamp, time);
  EXPECT_EQ(std::get<ros1::ImuMessage>(message).angular_velocity, (std::array<double, 3>{0.1, 0.2, 0.3}));
  EXPECT_EQ(std::get<ros1::ImuMessage>(message).linear_acceleration, (std::array<double, 3>{1, 2, 9.5}));
  ASSERT_TRUE(log.next(message, topic, time));
  const auto& cloud = std::get<ros1::PointCloudMessage>(message);
  EXPECT_EQ(cloud.stamp, 1'700'000'000'001'000'000);
  EXPECT_EQ(cloud.width, 2U);
  ASSERT_EQ(cloud.fields.size(), 4U);
  EXPECT_EQ(cloud.fields[3].name, "t");
  ASSERT_TRUE(log.next(message, topic, time));
  EXPECT_EQ(topic, 1U);
  EXPECT_EQ(std::get<ros1::MagneticFieldMessage>(message).field_tesla, (std::array<double, 3>{20e-6, 1.5e-6, -40e-6}));
  ASSERT_TRUE(log.next(message, topic, time));
  EXPECT_EQ(time, 1'700'000'000'005'000'000);
  EXPECT_FALSE(log.next(message, topic, time));

  testing::write_text(folder / "log/imu.csv", "time_s,wx\n1,2\n");
  const auto error = [&] {
    return testing::message_of<InputError>([&] { testing::DecodedLog again(folder / "log"); });
  };
  EXPECT_THAT(error(), ::testing::AllOf(HasSubstr("imu.csv:1"), HasSubstr("gyroscope_x_rad_s"),
                                        HasSubstr("remove the file from the folder")));
  testing::write_text(folder / "log/imu.csv", "time_s,field_x_ut,field_y_ut,field_z_ut\n1,2,3,4\n2,x,3,4\n3,4,5,6\n");
  EXPECT_THAT(error(), ::testing::AllOf(HasSubstr("imu.csv:3"), HasSubstr("'x' is not a number")));
}

/// A log that consists of links; links may be circular.
TEST(CsvLog, FollowsLinksToFolders) {
  const TemporaryFolder folder;
  const std::string field = "time_s,field_x_ut,field_y_ut,field_z_ut\n1,2,3,4\n";
  const std::string cloud =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 "
      "0\nPOINTS 1\n"
      "DATA ascii\n1 2 3\n";
  for (const char* name : {"log/own", "elsewhere/deeper", "clouds"}) fs::create_directories(folder.path() / name);
  testing::write_text(folder / "log/own/field.csv", field);
  testing::write_text(folder / "elsewhere/deeper/field.csv", field);
  testing::write_text(folder / "clouds/1.5.pcd", cloud);
  fs::create_directory_symlink(folder.path() / "elsewhere", folder.path() / "log/array");
  fs::create_directory_symlink("../../clouds", folder.path() / "log/own/points");
  fs::create_directory_symlink("..", folder.path() / "log/own/back");
  fs::create_directory_symlink("own", folder.path() / "log/again");
  fs::create_directory_symlink(folder.path() / "log", folder.path() / "elsewhere/deeper/log");
  fs::create_directory_symlink("absent", folder.path() / "log/absent");
  for (const std::string& name : {folder / "log", folder / "log/"}) {
    testing::DecodedLog log(name);
    std::vector<std::string> topics;
    for (const TopicInfo& topic : log.topics()) topics.push_back(topic.name);
    EXPECT_EQ(topics, (std::vector<std::string>{"/array/deeper/field", "/own/field", "/own/points"}));
    log.select(topics);
    ros1::Message message;
    std::size_t topic = 0, count = 0;
    for (Time time = 0; log.next(message, topic, time);) ++count;
    EXPECT_EQ(count, 3U);
  }
  // A log that consists of links only.
  fs::create_directories(folder.path() / "links");
  fs::create_directory_symlink("../clouds", folder.path() / "links/points");
  EXPECT_EQ(testing::DecodedLog(folder / "links").topics().size(), 1U);
}

/// An interrupted recorder may have written "10.0" of "10.069626", which is a number too.
TEST(CsvLog, LeavesOutALastLineWithoutAnEnd) {
  const TemporaryFolder folder;
  const std::string rows = "time_s,field_x_ut,field_y_ut,field_z_ut\n1,2,3,4\n2,3,4,10.0";
  for (const auto& [end, messages] :
       std::map<std::string, int>{{"", 1}, {"\r", 1}, {"\n", 2}, {"\r\n", 2}, {"\n\n  ", 2}}) {
    std::ofstream(folder / "field.csv", std::ios::binary) << rows << end;
    testing::DecodedLog log(folder.path().string());
    EXPECT_EQ(log.topic("/field").messages, messages);
    EXPECT_EQ(log.warnings.count("log.cut_off"), 2 - messages);
    log.select({"/field"});
    ros1::Message message;
    std::size_t topic = 0;
    int count = 0;
    for (Time time = 0; log.next(message, topic, time);) ++count;
    EXPECT_EQ(count, messages);
    EXPECT_EQ(log.warnings.count("log.cut_off"), 2 - messages) << "the second reading must not count it again";
  }
}

/// A cloud in each of PCD's encodings, with bytes altered in the header or anywhere.
TEST(CsvLog, SurvivesAlteredBytes) {
  const TemporaryFolder folder;
  fs::create_directories(folder.path() / "log/points");
  std::string imu =
      "time_ns,gyroscope_x_rad_s,gyroscope_y_rad_s,gyroscope_z_rad_s,accelerometer_x_m_s2,"
      "accelerometer_y_m_s2,accelerometer_z_m_s2\n";
  for (int i = 0; i < 20; ++i)
    imu += std::to_string(1'700'000'000'000'000'000 + i * 5'000'000) + ",0,0.25,-1e-3,0,0,9.8\n";
  const std::string header =
      "VERSION 0.7\nFIELDS x y z t\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 64\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 64\n";
  std::string ascii = header + "DATA ascii\n";
  for (int i = 0; i < 64; ++i) ascii += std::to_string(i) + " 2.5 -3 " + std::to_string(i * 1000) + "\n";
  const std::string binary = header + "DATA binary\n" + std::string(64 * 16, 'a');
  std::mt19937_64 random(7);
  int refused = 0;
  for (int round = 0; round < 200; ++round) {
    std::string files[] = {imu, round % 2 == 0 ? ascii : binary};
    std::string& altered = files[random() % 2];
    for (std::uint64_t changes = 1 + random() % 4; changes > 0; --changes) {
      const std::size_t at = random() % 3 == 0 ? random() % altered.size() : random() % 180;
      altered[at] = random() % 2 == 0 ? static_cast<char>('0' + random() % 10) : static_cast<char>(random());
    }
    if (random() % 10 == 0) altered.resize(random() % altered.size());
    std::ofstream(folder / "log/imu.csv", std::ios::binary) << files[0];
    std::ofstream(folder / "log/points/1700000000.05.pcd", std::ios::binary) << files[1];
    try {
      testing::DecodedLog log(folder / "log");
      std::vector<std::string> names;
      for (const TopicInfo& topic : log.topics()) names.push_back(topic.name);
      log.select(names);
      ros1::Message message;
      std::size_t topic = 0;
      for (Time time = 0; log.next(message, topic, time);) {
      }
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace lodestone
