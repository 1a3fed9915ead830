#include "frontends/messages/static_transforms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontends/logs/log_writer.h"
#include "frontends/logs/open_log.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/messages/result_messages.h"
#include "frontends/messages/wire_ros1.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const Pose base_imu{so3::exp(Vector3(0.1, -0.2, 0.3)), Vector3(0.1, 0.2, 0.3)};
const Pose base_mast{so3::exp(Vector3(0.0, 0.0, 1.5)), Vector3(-0.4, 0.0, 0.5)};
const Pose mast_lidar{so3::exp(Vector3(0.0, 0.5, 0.0)), Vector3(0.0, 0.0, 0.25)};

void expect_near(const std::optional<Pose>& found, const Pose& expected) {
  ASSERT_TRUE(found);
  EXPECT_LT(found->boxminus(expected).norm(), 1e-12);
}

StaticTransforms mounted_robot() {
  StaticTransforms transforms;
  transforms.add("base_link", "imu_link", base_imu);
  transforms.add("base_link", "mast", base_mast);
  transforms.add("mast", "lidar", mast_lidar);
  return transforms;
}

TEST(StaticTransformsTest, AChainGoesUpAndDownTheTree) {
  expect_near(mounted_robot().between("imu_link", "lidar"), base_imu.inverse() * base_mast * mast_lidar);
  expect_near(mounted_robot().between("lidar", "imu_link"), (base_mast * mast_lidar).inverse() * base_imu);
  expect_near(mounted_robot().between("mast", "lidar"), mast_lidar);
  expect_near(mounted_robot().between("/lidar", "lidar"), Pose{});
}

TEST(StaticTransformsTest, UnconnectedFramesHaveNoTransform) {
  EXPECT_FALSE(mounted_robot().between("imu_link", "camera"));
  EXPECT_FALSE(mounted_robot().between("imu_link", ""));
}

TEST(StaticTransformsTest, ACycleEnds) {
  StaticTransforms transforms;
  transforms.add("a", "b", base_imu);
  transforms.add("b", "a", base_mast);
  EXPECT_FALSE(transforms.between("a", "c"));
}

class StaticTransformsOfALog : public ::testing::Test {
 protected:
  StaticTransforms read(const std::string& path) {
    WarningLog warnings;
    StaticTransforms transforms;
    read_static_transforms(path, *open_log(path, warnings), transforms);
    return transforms;
  }

  /// A ROS 1 bag with one message on /tf_static.
  std::string bag(const std::vector<std::uint8_t>& bytes) {
    const std::string path = folder_ / "log.bag";
    ros1::BagWriter writer(path, Codec::none);
    writer.write({"/tf_static", "tf2_msgs/TFMessage", Encoding::ros1, 0, 0, 0, "94810edda583a504dfda3829e70d7eec", ""},
                 {1'700'000'000'000'000'000, 0, bytes.data(), bytes.size()});
    writer.close();
    return path;
  }

  static void put(Ros1WireWriter& wire, const std::string& parent, const std::string& child, const Pose& pose) {
    wire.header(0, parent);
    wire.text(child);
    for (const double value : pose.position) wire.number(value);
    for (const double value : pose.rotation.coeffs()) wire.number(value);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(StaticTransformsOfALog, Ros1) {
  Ros1WireWriter wire;
  wire.number(std::uint32_t{2});
  put(wire, "/base_link", "/imu_link", base_imu);
  put(wire, "base_link", "mast", base_mast);
  expect_near(read(bag(wire.take())).between("imu_link", "mast"), base_imu.inverse() * base_mast);
}

TEST_F(StaticTransformsOfALog, Ros2) {
  const std::string path = folder_ / "log.mcap";
  const auto writer = make_log_writer(path, LogFormat::mcap, Codec::zstd);
  const TopicInfo topic = result_topic("/robot/tf_static", "tf2_msgs/TFMessage");
  constexpr Time time = 1'700'000'000'000'000'000;
  for (const auto& bytes : {transform_message(time, "base_link", "imu_link", base_imu),
                            transform_message(time, "base_link", "mast", base_mast)}) {
    writer->write(topic, {time, 0, bytes.data(), bytes.size()});
  }
  writer->close();
  expect_near(read(path).between("imu_link", "mast"), base_imu.inverse() * base_mast);
}

TEST_F(StaticTransformsOfALog, ATransformWithoutARotationIsIgnored) {
  Ros1WireWriter wire;
  wire.number(std::uint32_t{1});
  Pose none = base_imu;
  none.rotation.coeffs().setZero();
  put(wire, "base_link", "imu_link", none);
  EXPECT_TRUE(read(bag(wire.take())).empty());
}

TEST_F(StaticTransformsOfALog, ACutMessageIsOneLine) {
  Ros1WireWriter wire;
  wire.number(std::uint32_t{1});
  put(wire, "base_link", "imu_link", base_imu);
  std::vector<std::uint8_t> bytes = wire.take();
  bytes.resize(bytes.size() - 8);
  const std::string path = bag(bytes);
  EXPECT_THAT(testing::message_of<InputError>([&]() { read(path); }),
              AllOf(HasSubstr(path + ": topic /tf_static"), HasSubstr("record the log again")));
}

}  // namespace
}  // namespace lodestone
