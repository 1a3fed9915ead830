// MCAP files written by @mcap/core, an independent library.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

class McapCore : public ::testing::TestWithParam<const char*> {};

TEST_P(McapCore, IsReadAsItWasWritten) {
  const std::string packages = LODESTONE_MCAP_CORE;
  if (packages.empty() || !std::filesystem::exists(packages + "/node_modules/@mcap/core")) {
    GTEST_SKIP() << "@mcap/core was not fetched: node, npm or its registry was not there when the tests were built";
  }
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

}  // namespace
}  // namespace lodestone
