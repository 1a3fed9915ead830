#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "frontends/configuration/text_file.h"
#include "frontends/logs/ros1/bag_index.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "tests/frontends/logs/bag_messages.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone::ros1 {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::testing::HasSubstr;

constexpr Time start = bag_start;

class RoundTrip : public ::testing::TestWithParam<Codec> {};

TEST_P(RoundTrip, GivesBackWhatWasWrittenInOrderOfRecordTime) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  std::vector<std::vector<std::uint8_t>> clouds;
  {
    BagWriter writer(path, GetParam());
    for (int scan = 0; scan < 5; ++scan) {
      std::vector<std::uint8_t>& bytes = clouds.emplace_back(800'000);
      for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>((i * i + scan) >> 3);
      PointCloudMessage cloud = cloud_of(bytes);
      cloud.stamp = start + scan * 100'000'000;
      // Written before its IMU samples, though recorded after them: the index restores the order.
      writer.write("/points", cloud.stamp + 100'000'000, cloud);
      for (int sample = 0; sample < 20; ++sample) {
        ImuMessage imu;
        imu.stamp = cloud.stamp + sample * 5'000'000;
        imu.frame = "imu";
        imu.angular_velocity = {0.1, 0.2, 0.3 + scan};
        imu.linear_acceleration = {0.0, 1e-3 * sample, 9.81};
        writer.write("/imu", imu.stamp, imu);
        MagneticFieldMessage field;
        field.stamp = imu.stamp + 1;
        field.frame = "mag";
        field.field_tesla = {2e-5, -1e-6, 4.5e-5};
        writer.write("/field", field.stamp, field);
      }
    }
    EXPECT_FALSE(std::filesystem::exists(path)) << "the bag must not carry its name before it is whole";
    writer.close();
  }
  testing::DecodedLog reader(path);
  ASSERT_EQ(reader.topics().size(), 3U);
  EXPECT_EQ(reader.topics()[0].name, "/field");
  EXPECT_EQ(reader.topics()[1].type, "sensor_msgs/Imu");
  EXPECT_EQ(reader.topics()[1].messages, 100);
  EXPECT_EQ(reader.topics()[1].begin, start);
  EXPECT_EQ(reader.topics()[2].end, start + 500'000'000);

  reader.select({"/points", "/imu"});
  Message message;
  std::size_t topic = 99;
  Time record_time = 0;
  Time previous = 0;
  int scans = 0;
  int samples = 0;
  while (reader.next(message, topic, record_time)) {
    EXPECT_GE(record_time, previous);
    previous = record_time;
    if (const auto* cloud = std::get_if<PointCloudMessage>(&message)) {
      EXPECT_EQ(topic, 0U);
      EXPECT_EQ(cloud->stamp, start + scans * 100'000'000);
      EXPECT_EQ(cloud->frame, "lidar");
      ASSERT_EQ(cloud->fields.size(), 2U);
      EXPECT_EQ(cloud->fields[1].name, "t");
      EXPECT_EQ(cloud->fields[1].datatype, PointField::uint32);
      EXPECT_TRUE(cloud->dense);
      ASSERT_EQ(cloud->data_size, clouds[scans].size());
      EXPECT_TRUE(std::equal(cloud->data, cloud->data + cloud->data_size, clouds[scans].begin()));
      ++scans;
    } else {
      const auto& imu = std::get<ImuMessage>(message);
      EXPECT_EQ(topic, 1U);
      EXPECT_EQ(imu.stamp, start + (samples / 20) * 100'000'000 + (samples % 20) * 5'000'000);
      EXPECT_EQ(imu.angular_velocity[2], 0.3 + samples / 20);
      EXPECT_EQ(imu.linear_acceleration[1], 1e-3 * (samples % 20));
      ++samples;
    }
  }
  EXPECT_EQ(scans, 5);
  EXPECT_EQ(samples, 100);

  reader.select({"/field"});
  ASSERT_TRUE(reader.next(message, topic, record_time));
  EXPECT_EQ(std::get<MagneticFieldMessage>(message).field_tesla[2], 4.5e-5);
  EXPECT_EQ(std::get<MagneticFieldMessage>(message).frame, "mag");
}

INSTANTIATE_TEST_SUITE_P(EachCompression, RoundTrip, ::testing::Values(Codec::none, Codec::lz4, Codec::bz2));

TEST(BagWriterTest, LeavesNothingBehindWithoutClose) {
  const TemporaryFolder folder;
  {
    BagWriter writer(folder / "log.bag", Codec::lz4);
    writer.write("/imu", start, ImuMessage{start, "imu", {}, {}});
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(BagWriterTest, RefusesWhatItCannotWrite) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { BagWriter(folder / "absent/log.bag", Codec::none); }),
              HasSubstr("absent/log.bag"));
  BagWriter writer(folder / "log.bag", Codec::none);
  EXPECT_THAT(message_of<InputError>([&] {
                writer.write("/imu", start, ImuMessage{-5, "imu", {}, {}});
              }),
              HasSubstr("does not fit ROS time"));
}

/// The checksum must be that of the definition in the bag: ROS tools compare both.
TEST(BagWriterTest, DescribesKnownTypesAsRosDoes) {
  const TemporaryFolder folder;
  {
    BagWriter writer(folder / "log.bag", Codec::none);
    writer.write("/points", start, cloud_of({}));
    writer.write("/livox", start, LivoxMessage{});
    writer.write("/imu", start, ImuMessage{start, "imu", {}, {}});
    writer.write("/field", start, MagneticFieldMessage{start, "field", {}});
    writer.close();
  }
  testing::DecodedLog log(folder / "log.bag");
  EXPECT_EQ(log.topic("/points").md5, "1158d486dd51d683ce2f1be655c3c181");
  EXPECT_EQ(log.topic("/livox").md5, "e4d6829bdfe657cb6c21a746c86b21a6");
  EXPECT_EQ(log.topic("/imu").md5, "6a62c6daae103f4ff57a132d6f95cec2");
  EXPECT_EQ(log.topic("/field").md5, "2f3b0b43eed0c9501de0fa3ff89a45aa");
  for (const TopicInfo& topic : log.topics()) {
    EXPECT_THAT(topic.definition, HasSubstr("MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"))
        << topic.name;
  }
}

TEST(BagIndexTest, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  WarningLog warnings;
  const auto error = [&](const std::string& path) { return message_of<InputError>([&] { BagIndex(path, warnings); }); };
  EXPECT_THAT(error(folder / "none.bag"), HasSubstr("none.bag: "));
  testing::write_text(folder / "empty.bag", "");
  EXPECT_THAT(error(folder / "empty.bag"), HasSubstr("is not a ROS 1 bag"));
  testing::write_text(folder / "other.bag", "just some text, and no bag");
  EXPECT_THAT(error(folder / "other.bag"), HasSubstr("is not a ROS 1 bag"));
  testing::write_text(folder / "old.bag", "#ROSBAG V1.2\n");
  EXPECT_THAT(error(folder / "old.bag"), HasSubstr("another version than 2.0"));
  testing::write_text(folder / "short.bag", "#ROSBAG V2.0\n");
  EXPECT_THAT(error(folder / "short.bag"), HasSubstr("no message before"));
}

/// If a bag is cut anywhere, either its messages up to the cut are read with a warning, or the bag is refused.
TEST(BagIndexTest, SaysThatABagIsCutOffWhereverItEnds) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  {
    BagWriter writer(path, Codec::lz4);
    for (int i = 0; i < 500; ++i) writer.write("/imu", start + i, ImuMessage{start + i, "imu", {1.0 * i}, {}});
    writer.close();
  }
  const auto size = std::filesystem::file_size(path);
  for (std::uintmax_t kept = size - 1; kept > 0; kept -= std::min<std::uintmax_t>(kept, kept > size - 1000 ? 7 : 997)) {
    const std::string cut = folder / "cut.bag";
    std::filesystem::copy_file(path, cut, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(cut, kept);
    WarningLog warnings;
    try {
      BagIndex index(cut, warnings);
      EXPECT_EQ(warnings.count("log.cut_off"), 1) << kept << " of " << size;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::AnyOf(HasSubstr("cut off"), HasSubstr("is not a ROS 1 bag")))
          << kept << " of " << size;
    }
  }
}

TEST(BagIndexTest, SelectRefusesAbsentTopics) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  {
    BagWriter writer(path, Codec::none);
    writer.write("/imu", start, ImuMessage{start, "imu", {}, {}});
    writer.close();
  }
  testing::DecodedLog reader(path);
  EXPECT_THAT(message_of<InputError>([&] { reader.select({"/imu", "/points"}); }), HasSubstr("/points"));
}

TEST(RealBags, ThreeCompressionsHoldTheSame) {
  std::vector<std::map<std::string, std::int64_t>> counts;
  for (const char* name : {"bags/example.bag", "bags/example-lz4.bag", "bags/example-bz2.bag"}) {
    LODESTONE_REAL_DATA(path, name);
    testing::DecodedLog reader(path);
    auto& count = counts.emplace_back();
    for (const TopicInfo& topic : reader.topics()) {
      count[topic.name + " " + topic.type] = topic.messages;
      EXPECT_GT(topic.messages, 0) << topic.name;
      EXPECT_LE(topic.begin, topic.end);
    }
    EXPECT_FALSE(count.empty());
  }
  EXPECT_EQ(counts[0], counts[1]);
  EXPECT_EQ(counts[0], counts[2]);
}

TEST(RealBags, ImuAndFieldOfADroneAreReadWhole) {
  LODESTONE_REAL_DATA(path, "bags/ardrone_imu.bag");
  testing::DecodedLog reader(path);
  std::vector<std::string> topics;
  std::int64_t expected = 0;
  for (const TopicInfo& topic : reader.topics()) {
    if (topic.type != "sensor_msgs/Imu" && topic.type != "sensor_msgs/MagneticField") continue;
    topics.push_back(topic.name);
    expected += topic.messages;
  }
  ASSERT_EQ(topics.size(), 2U);
  reader.select(topics);
  Message message;
  std::size_t topic = 0;
  Time record_time = 0;
  std::int64_t count = 0;
  while (reader.next(message, topic, record_time)) ++count;
  EXPECT_EQ(count, expected);
}

TEST(RealBags, OusterCloudsCarryTimeAndRing) {
  LODESTONE_REAL_DATA(path, "bags/ouster_os1_128_ros1_bz2.bag");
  testing::DecodedLog reader(path);
  std::vector<std::string> topics;
  for (const TopicInfo& topic : reader.topics()) {
    if (topic.type == "sensor_msgs/PointCloud2") topics.push_back(topic.name);
  }
  reader.select(topics);
  Message message;
  std::size_t topic = 0;
  Time record_time = 0;
  int scans = 0;
  while (reader.next(message, topic, record_time)) {
    const auto& cloud = std::get<PointCloudMessage>(message);
    std::map<std::string, int> fields;
    for (const PointField& field : cloud.fields) fields[field.name] = field.datatype;
    EXPECT_EQ(fields.at("t"), PointField::uint32);
    EXPECT_EQ(fields.count("ring"), 1U);
    // The fields of these messages announce 32 bytes per point, but the data is packed into 22: see point_fields.cpp.
    EXPECT_EQ(cloud.point_step, 32U);
    EXPECT_EQ(cloud.data_size, std::size_t{cloud.height} * cloud.width * 22);
    ++scans;
  }
  EXPECT_EQ(scans, 3);
}

}  // namespace
}  // namespace lodestone::ros1
