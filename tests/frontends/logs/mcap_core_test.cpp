// MCAP files that @mcap/core, an independent library, writes or reads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "frontends/logs/log_writer.h"
#include "frontends/messages/result_messages.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

/// Empty if the library was not fetched.
std::string mcap_core_folder() {
  const std::string packages = LODESTONE_MCAP_CORE;
  return !packages.empty() && std::filesystem::exists(packages + "/node_modules/@mcap/core") ? packages : "";
}

constexpr const char* not_fetched =
    "@mcap/core was not fetched: node, npm or its registry was not there when the tests were built";

class McapCore : public ::testing::TestWithParam<const char*> {};

TEST_P(McapCore, IsReadAsItWasWritten) {
  const std::string packages = mcap_core_folder();
  if (packages.empty()) GTEST_SKIP() << not_fetched;
  const testing::TemporaryFolder folder;
  const std::string path = folder / "log.mcap";
  const std::string command = "node '" + packages + "/write.mjs' '" + path + "' " + GetParam();
  ASSERT_EQ(std::system(command.c_str()), 0) << command;

  testing::DecodedLog log(path);
  ASSERT_EQ(log.topics().size(), 2U);
  EXPECT_EQ(log.topic("/imu").messages, 400);
  EXPECT_EQ(log.topic("/imu").type, "sensor_msgs/Imu");
  EXPECT_EQ(log.topic("/imu").begin, 1'700'000'000'000'000'000);
  EXPECT_EQ(log.topic("/imu").end, 1'700'000'000'000'000'000 + 399 * 5'000'000);
  EXPECT_EQ(log.topic("/other").messages, 20);
  log.select({"/imu"});
  ros1::Message message;
  std::size_t topic = 0;
  Time time = 0;
  for (int index = 0; index < 400; ++index) {
    ASSERT_TRUE(log.next(message, topic, time));
    const auto& imu = std::get<ros1::ImuMessage>(message);
    ASSERT_EQ(time, 1'700'000'000'000'000'000 + index * 5'000'000);
    EXPECT_EQ(imu.stamp, time);
    EXPECT_EQ(imu.frame, "imu");
    EXPECT_EQ(imu.angular_velocity[0], index + 13.0 / 64);
    EXPECT_EQ(imu.linear_acceleration[2], index + 27.0 / 64);
  }
  EXPECT_FALSE(log.next(message, topic, time));
  EXPECT_TRUE(log.warnings.entries().empty());
}

INSTANTIATE_TEST_SUITE_P(Layouts, McapCore, ::testing::Values("chunked", "plain", "bare"));

TEST(McapCoreReader, ReadsResultMessages) {
  const std::string packages = mcap_core_folder();
  if (packages.empty()) GTEST_SKIP() << not_fetched;
  const testing::TemporaryFolder folder;
  constexpr Time begin = 1'700'000'000'250'000'000;
  const auto writer = make_log_writer(folder / "results.mcap", LogFormat::mcap, Codec::none);
  const TopicInfo tf = result_topic("/tf", "tf2_msgs/TFMessage");
  const TopicInfo odometry = result_topic("/odometry", "nav_msgs/Odometry");
  for (int i = 0; i < 3000; ++i) {  // several chunks
    const Time time = begin + i * 100'000'000LL;
    for (const TopicInfo* topic : {&tf, &odometry}) {
      const auto bytes =
          topic == &tf ? transform_message(time, "map", "imu", {}) : odometry_message(time, "map", "imu", {}, {});
      writer->write(*topic, {time, 0, bytes.data(), bytes.size()});
    }
  }
  writer->close();
  const std::string out = folder / "out.txt";
  const std::string command = "node '" + packages + "/read.mjs' '" + (folder / "results.mcap") + "' >'" + out + "'";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream stream(out);
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  // Little-endian CDR; then stamp 1700000000 s and 250000000 ns, "map", "imu".
  const std::string header = "00f1536580b2e60e040000006d61700004000000696d7500";
  EXPECT_THAT(text, ::testing::StartsWith("ros2\n/odometry nav_msgs/msg/Odometry ros2msg 3000 1700000000250000000 "
                                          "00010000" +
                                          header));
  EXPECT_THAT(text, ::testing::HasSubstr("/tf tf2_msgs/msg/TFMessage ros2msg 3000 1700000000250000000 "
                                         "0001000001000000" +
                                         header));
}

}  // namespace
}  // namespace lodestone
