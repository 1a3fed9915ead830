#include "frontends/messages/result_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "core/error.h"
#include "frontends/logs/open_log.h"
#include "frontends/logs/ros2/bag_folder_writer.h"
#include "frontends/messages/message_decoder.h"
#include "frontends/messages/message_definition.h"
#include "frontends/messages/message_paths.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::lodestone::testing::write_text;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Time result_time = 1'700'000'000'250'000'000;

Pose turned_pose() {
  return {so3::exp(Vector3(0.3, -0.2, 2.0)), Vector3(1.5, -2.5, 0.25)};
}

/// Vectors of a message, read by the definition that is stored with the topic.
std::vector<MessagePaths::Vector> read_paths(const std::string& type, const std::vector<std::uint8_t>& bytes,
                                             const std::vector<std::string>& names) {
  MessagePaths paths("results", result_topic("/topic", type));
  for (const std::string& name : names) paths.add(name, "key");
  std::vector<MessagePaths::Vector> vectors;
  paths.read({result_time, 0, bytes.data(), bytes.size()}, vectors);
  return vectors;
}

TEST(ResultMessages, AreReadByTheirDefinitions) {
  const Pose pose = turned_pose();
  RosCovariance covariance{};
  for (std::size_t i = 0; i < covariance.size(); ++i) covariance[i] = static_cast<double>(i);
  const auto odometry =
      read_paths("nav_msgs/Odometry", odometry_message(result_time, "map", "imu", pose, covariance),
                 {"pose.pose.position", "pose.covariance[33]", "twist.twist.linear", "twist.covariance[33]"});
  EXPECT_THAT(odometry[0].values, ElementsAre(1.5, -2.5, 0.25));
  EXPECT_EQ(odometry[0].stamp, result_time);
  EXPECT_THAT(odometry[1].values, ElementsAre(33.0, 34.0, 35.0));
  EXPECT_THAT(odometry[2].values, ElementsAre(0.0, 0.0, 0.0));
  EXPECT_THAT(odometry[3].values, ElementsAre(0.0, 0.0, 0.0));

  const auto transform = read_paths("tf2_msgs/TFMessage", transform_message(result_time, "map", "imu", pose),
                                    {"transforms[0].transform.translation", "transforms[0].transform.rotation"});
  EXPECT_THAT(transform[0].values, ElementsAre(1.5, -2.5, 0.25));
  EXPECT_THAT(transform[1].values, ElementsAre(pose.rotation.x(), pose.rotation.y(), pose.rotation.z()));

  const Trajectory trajectory{{result_time, {}}, {result_time + 7, pose}};
  const auto path =
      read_paths("nav_msgs/Path", path_message(result_time, "map", trajectory), {"poses[1].pose.position"});
  EXPECT_THAT(path[0].values, ElementsAre(1.5, -2.5, 0.25));
  EXPECT_EQ(path[0].stamp, result_time + 7);
}

TEST(ResultMessages, EveryDefinitionIsComplete) {
  for (const char* type : {"tf2_msgs/TFMessage", "nav_msgs/Path", "nav_msgs/Odometry",
                           "diagnostic_msgs/DiagnosticArray", "sensor_msgs/PointCloud2"}) {
    const TopicInfo topic = result_topic("/topic", type);
    EXPECT_EQ(topic.definition_encoding, "ros2msg");
    EXPECT_FALSE(parse_definition(type, topic.definition).at(type).empty()) << type;  // throws if a part is missing
    EXPECT_THAT(topic.definition, HasSubstr("MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n"));
    EXPECT_THAT(topic.definition, HasSubstr("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"));
  }
  EXPECT_THROW(result_topic("/topic", "std_msgs/String"), std::invalid_argument);
}

/// The bytes by hand, as the CDR specification defines them: no reader of this program is used.
TEST(ResultMessages, DiagnosticsHaveTheBytesOfCdr) {
  DiagnosticStatus status;
  status.level = DiagnosticStatus::error;
  status.name = "ab";
  status.message = "lost";
  status.values = {{"k", "v"}};
  const auto bytes = diagnostics_message(result_time, status);
  const std::string expected(
      "\0\1\0\0"                            // little-endian CDR
      "\x00\xf1\x53\x65\x80\xb2\xe6\x0e"    // stamp
      "\1\0\0\0\0\0\0\0"                    // empty frame and padding
      "\1\0\0\0"                            // one status
      "\2\0\0\0"                            // level and padding
      "\3\0\0\0ab\0\0"                      // name and padding
      "\5\0\0\0lost\0\0\0\0"                // message and padding
      "\1\0\0\0\0\0\0\0"                    // empty hardware_id and padding
      "\1\0\0\0\2\0\0\0k\0\0\0\2\0\0\0v\0"  // one value
      ,
      4 + 8 + 8 + 4 + 4 + 8 + 12 + 8 + 18);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), expected);
}

TEST(ResultMessages, CovarianceHasTheOrderAndTheAxesOfRos) {
  const Pose pose = turned_pose();
  // The error is one turn about the body's x axis, correlated with a shift along the map's y axis.
  Vector6 error;
  error << 0.01, 0.0, 0.0, 0.0, 0.2, 0.0;
  const RosCovariance values = ros_covariance(pose, error * error.transpose());
  const Vector3 axis = pose.rotation * Vector3::UnitX();  // the same turn in map axes
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(values[static_cast<std::size_t>(6 * 1 + 3 + i)], 0.2 * 0.01 * axis(i), 1e-15);
    EXPECT_NEAR(values[static_cast<std::size_t>(6 * (3 + i) + 3 + i)], 1e-4 * axis(i) * axis(i), 1e-15);
  }
  EXPECT_NEAR(values[7], 0.04, 1e-15);
  EXPECT_NEAR(values[0], 0.0, 1e-15);
  // That axis describes the same rotation from the left.
  const Quaternion right = pose.rotation * so3::exp(Vector3(0.01, 0.0, 0.0));
  const Quaternion left = so3::exp(Vector3(0.01 * axis)) * pose.rotation;
  EXPECT_LT(right.angularDistance(left), 1e-12);
  const Matrix6 unknown = Matrix6::Constant(std::numeric_limits<double>::infinity());
  EXPECT_EQ(ros_covariance(pose, unknown), RosCovariance{});
}

TEST(ResultMessages, StampsThatRos2CannotStoreAreRefused) {
  EXPECT_THAT(message_of<InputError>([] { transform_message(-1, "map", "imu", {}); }), HasSubstr("does not fit ROS 2"));
  EXPECT_THAT(message_of<InputError>([] { path_message(Time{1} << 62, "map", {}); }), HasSubstr("--to tum"));
}

TEST(BagFolderWriter, WritesAFolderThatTheReaderOpensByItsMetadata) {
  const TemporaryFolder folder;
  const TopicInfo tf = result_topic("/tf", "tf2_msgs/TFMessage");
  for (int round = 0; round < 2; ++round) {  // the second folder replaces the first
    BagFolderWriter writer(folder / "bag/");
    for (int i = 0; i < 10; ++i) {
      const auto bytes = transform_message(result_time + i, "map", "imu", {});
      writer.write(tf, {result_time + i, 0, bytes.data(), bytes.size()});
    }
    EXPECT_EQ(std::filesystem::exists(folder / "bag"), round == 1);
    writer.close();
  }
  WarningLog warnings;
  const auto source = open_log(folder / "bag/metadata.yaml", warnings);
  ASSERT_EQ(source->topics().size(), 1U);
  EXPECT_EQ(source->topics().front().messages, 10);
  EXPECT_EQ(source->topics().front().end, result_time + 9);
  EXPECT_EQ(source->topics().front().definition, tf.definition);
  EXPECT_TRUE(warnings.entries().empty());
  int entries = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++entries;
  EXPECT_EQ(entries, 1);  // no temporary folder remains
}

TEST(BagFolderWriter, DeletesOnlyWhatItWrote) {
  const TemporaryFolder folder;
  { BagFolderWriter writer(folder / "unfinished"); }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  std::filesystem::create_directory(folder / "recorded");
  write_text(folder / "recorded/metadata.yaml", "");
  write_text(folder / "recorded/night_0.db3", "");
  EXPECT_THAT(message_of<InputError>([&] { BagFolderWriter writer(folder / "recorded"); }),
              HasSubstr("files that no export wrote"));
  write_text(folder / "file", "");
  EXPECT_THAT(message_of<InputError>([&] { BagFolderWriter writer(folder / "file"); }), HasSubstr("a bag is a folder"));
}

}  // namespace
}  // namespace lodestone
