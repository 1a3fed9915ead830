#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "frontends/logs/ros1/bag_reader.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/logs/rosbag/checked_bag.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone::ros1 {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::testing::HasSubstr;

constexpr Time start = 1'700'000'000'123'456'789;

PointCloudMessage cloud_of(const std::vector<std::uint8_t>& bytes) {
  PointCloudMessage cloud;
  cloud.frame = "lidar";
  cloud.fields = {{"x", 0, PointField::float32, 1}, {"t", 4, PointField::uint32, 1}};
  cloud.point_step = 8;
  cloud.width = static_cast<std::uint32_t>(bytes.size() / 8);
  cloud.row_step = static_cast<std::uint32_t>(bytes.size());
  cloud.data = bytes.data();
  cloud.data_size = bytes.size();
  return cloud;
}

class RoundTrip : public ::testing::TestWithParam<Compression> {};

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
      // Written before its IMU samples, though recorded after them: the index puts them in order.
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

INSTANTIATE_TEST_SUITE_P(EachCompression, RoundTrip,
                         ::testing::Values(Compression::none, Compression::lz4, Compression::bz2));

TEST(BagWriterTest, LeavesNothingBehindWithoutClose) {
  const TemporaryFolder folder;
  {
    BagWriter writer(folder / "log.bag", Compression::lz4);
    writer.write("/imu", start, ImuMessage{start, "imu", {}, {}});
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(BagWriterTest, RefusesWhatItCannotWrite) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<BagError>([&] { BagWriter(folder / "absent/log.bag", Compression::none); }),
              HasSubstr("absent/log.bag"));
  BagWriter writer(folder / "log.bag", Compression::none);
  EXPECT_THAT(message_of<BagError>([&] { writer.write("/imu", start, ImuMessage{-5, "imu", {}, {}}); }),
              HasSubstr("does not fit ROS time"));
}

TEST(BagReaderTest, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  WarningLog warnings;
  EXPECT_THAT(message_of<BagError>([&] { BagReader(folder / "none.bag", warnings); }), HasSubstr("no such file"));
  EXPECT_THAT(message_of<BagError>([&] { BagReader(folder.path().string(), warnings); }), HasSubstr("no regular file"));
  testing::write_text(folder / "empty.bag", "");
  EXPECT_THAT(message_of<BagError>([&] { BagReader(folder / "empty.bag", warnings); }), HasSubstr("is no ROS 1 bag"));
  testing::write_text(folder / "other.bag", "just some text, and no bag");
  EXPECT_THAT(message_of<BagError>([&] { BagReader(folder / "other.bag", warnings); }), HasSubstr("is no ROS 1 bag"));
}

TEST(BagReaderTest, SaysThatABagIsTruncatedWhereverItEnds) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  {
    BagWriter writer(path, Compression::lz4);
    for (int i = 0; i < 500; ++i) writer.write("/imu", start + i, ImuMessage{start + i, "imu", {1.0 * i}, {}});
    writer.close();
  }
  WarningLog warnings;
  const auto size = std::filesystem::file_size(path);
  for (const double share : {0.99, 0.8, 0.5, 0.1}) {
    const std::string cut = folder / "cut.bag";
    std::filesystem::copy_file(path, cut, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(cut, static_cast<std::uintmax_t>(share * static_cast<double>(size)));
    EXPECT_THAT(message_of<BagError>([&] { BagReader reader(cut, warnings); }), HasSubstr("truncated")) << share;
    EXPECT_THAT(message_of<InputError>([&] { CheckedBag reader(cut, warnings); }), HasSubstr("truncated")) << share;
  }
}

TEST(BagReaderTest, SelectRefusesAbsentTopics) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  {
    BagWriter writer(path, Compression::none);
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
    // These messages lay their fields out in 32 bytes a point, yet pack their data into 22: see point_cloud_layout.h.
    EXPECT_EQ(cloud.point_step, 32U);
    EXPECT_EQ(cloud.data_size, std::size_t{cloud.height} * cloud.width * 22);
    ++scans;
  }
  EXPECT_EQ(scans, 3);
}

}  // namespace
}  // namespace lodestone::ros1
