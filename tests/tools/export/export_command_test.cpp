// `lodestone export` as called by users, on a real short run.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/open_log.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/tools/program_runner.h"
#include "tests/tools/run/office_world.h"
#include "tools/run/folder_lock.h"
#include "tools/writers/covariance_file.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

/// Simulated and run once for all tests of this file.
class ExportCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::ofstream(path("office.yaml")) << office_world;
    expect_done("simulate " + path("office.yaml") + " --sequence short --duration 2 --only log,cloud --out " +
                path("site"));
    expect_done("run " + path("site/log.bag") + " --platform " + path("site/platform.yaml") + " --cloud " +
                path("site/cloud.pcd") + " --initial-pose-from " + path("site/truth.tum") + " --truth " +
                path("site/truth.tum") + " --estimator smoother,lidar-inertial --out " + path("run"));
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string path(const std::string& name) { return (*folder_ / name).string(); }

  static void expect_done(const std::string& arguments) {
    const ProgramResult result = run_lodestone(arguments);
    ASSERT_EQ(result.code, 0) << arguments << "\n" << result.errors;
  }

  static Trajectory trajectory(const std::string& estimator) {
    return read_tum(path("run/" + estimator + "/trajectory.tum"));
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};

std::unique_ptr<TemporaryFolder> ExportCommand::folder_;

std::map<std::string, TopicInfo> topics_in(const std::string& log) {
  WarningLog warnings;
  std::map<std::string, TopicInfo> topics;
  const auto reader = open_log(log, warnings);
  for (const TopicInfo& topic : reader->topics()) topics[topic.name] = topic;
  EXPECT_TRUE(warnings.entries().empty());
  return topics;
}

/// Numbers at a byte of a message, without any reader of this program.
template <class Number>
Number number_at(const std::string& bytes, std::size_t at) {
  Number value{};
  if (at + sizeof(value) <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

/// Points have a residual, and most are within 5 cm of the map.
void expect_scan_on_map(const std::string& log) {
  testing::DecodedLog scans(log);
  scans.select({"/lodestone/scan"});
  ros1::Message message;
  std::size_t topic = 0;
  Time time = 0;
  ASSERT_TRUE(scans.next(message, topic, time));
  const auto& cloud = std::get<ros1::PointCloudMessage>(message);
  ASSERT_EQ(cloud.fields.size(), 5U);
  EXPECT_EQ(cloud.fields[4].name, "residual_m");
  int on_plane = 0, near = 0;
  double squares_m2 = 0.0;
  for (std::size_t at = 0; at < cloud.data_size; at += cloud.point_step) {
    float residual_m = 0.0F;
    std::memcpy(&residual_m, cloud.data + at + cloud.fields[4].offset, sizeof(residual_m));
    if (std::isnan(residual_m)) continue;
    ++on_plane;
    squares_m2 += static_cast<double>(residual_m * residual_m);
    if (std::abs(residual_m) < 0.05F) ++near;
  }
  EXPECT_GT(on_plane, static_cast<int>(cloud.width) / 2);
  EXPECT_GT(near, 9 * on_plane / 10);
  EXPECT_GT(std::sqrt(squares_m2 / on_plane), 1e-3);  // the LiDAR has noise
}

TEST_F(ExportCommand, ReplacesAFileOnlyWithForce) {
  const std::string log = content_of(path("site/log.bag"));
  const std::string call = "export " + path("run") + " --to mcap --out " + path("site/log.bag");
  expect_refused(call, "--out " + path("site/log.bag") + ": the file exists; choose another name, or set --force");
  EXPECT_EQ(content_of(path("site/log.bag")), log);
  std::ofstream(path("old.mcap")) << "old";
  expect_refused("export " + path("run") + " --to mcap --out " + path("old.mcap"), "the file exists");
  expect_done("export " + path("run") + " --to mcap --force --out " + path("old.mcap"));
}

TEST_F(ExportCommand, McapHasAllTopicsInTheLogsTime) {
  expect_done("export " + path("run") + " --to mcap --log " + path("site/log.bag"));
  const auto topics = topics_in(path("run/export.mcap"));
  std::set<std::string> found;
  for (const auto& [name, topic] : topics) found.insert(name + " " + topic.type);
  EXPECT_THAT(found, IsSupersetOf({"/tf tf2_msgs/TFMessage", "/diagnostics diagnostic_msgs/DiagnosticArray",
                                   "/lodestone/map sensor_msgs/PointCloud2", "/lodestone/truth nav_msgs/Path",
                                   "/lodestone/scan sensor_msgs/PointCloud2", "/lodestone/smoother/path nav_msgs/Path",
                                   "/lodestone/smoother/odometry nav_msgs/Odometry",
                                   "/lodestone/lidar_inertial/path nav_msgs/Path",
                                   "/lodestone/lidar_inertial/odometry nav_msgs/Odometry"}));
  const Trajectory poses = trajectory("smoother");
  const TopicInfo& odometry = topics.at("/lodestone/smoother/odometry");
  EXPECT_EQ(odometry.messages, static_cast<std::int64_t>(poses.size()));
  EXPECT_EQ(odometry.begin, poses.front().time);
  EXPECT_EQ(odometry.end, poses.back().time);
  EXPECT_EQ(topics.at("/tf").messages, static_cast<std::int64_t>(poses.size() + trajectory("lidar-inertial").size()));
  EXPECT_EQ(topics.at("/lodestone/smoother/path").messages, 1);
  EXPECT_GT(topics.at("/lodestone/scan").messages, 10);
  expect_scan_on_map(path("run/export.mcap"));

  // A second export replaces the first; one estimator, no scans.
  expect_done("export " + path("run") + " --to mcap --estimator lidar-inertial");
  const auto one = topics_in(path("run/export.mcap"));
  EXPECT_EQ(one.count("/lodestone/smoother/path") + one.count("/lodestone/scan"), 0U);
  EXPECT_EQ(one.count("/lodestone/lidar_inertial/path"), 1U);
}

/// An independent library reads the same topics and numbers of messages. It cannot unpack zstd under Debian's Node.js.
TEST_F(ExportCommand, McapIsReadByMcapCore) {
  const std::string packages = LODESTONE_MCAP_CORE;
  if (packages.empty() || !fs::exists(packages + "/node_modules/@mcap/core")) {
    GTEST_SKIP() << "@mcap/core was not fetched: node, npm or its registry was not there when the tests were built";
  }
  expect_done("export " + path("run") + " --to mcap --log " + path("site/log.bag") + " --out " + path("packed.mcap"));
  expect_done("convert " + path("packed.mcap") + " --compression none --out " + path("plain.mcap"));
  const std::string command =
      "node '" + packages + "/read.mjs' '" + path("plain.mcap") + "' >'" + path("read.txt") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  const std::string read = content_of(path("read.txt"));
  const auto topics = topics_in(path("packed.mcap"));
  EXPECT_GE(topics.size(), 8U);
  for (const auto& [name, topic] : topics) {
    std::string type = topic.type;
    type.replace(type.find('/'), 1, "/msg/");
    EXPECT_THAT(read, HasSubstr(fmt::format("\n{} {} ros2msg {} {} ", name, type, topic.messages, topic.begin)));
  }
}

TEST_F(ExportCommand, MessagesOfABagFolderAreThoseOfTheRun) {
  expect_done("export " + path("run") + " --to db3 --out " + path("bag"));
  EXPECT_THAT(content_of(path("bag/metadata.yaml")),
              AllOf(HasSubstr("storage_identifier: sqlite3"), HasSubstr("type: nav_msgs/msg/Odometry"),
                    HasSubstr("- \"lodestone_0.db3\"")));
  const SqliteDatabase database = open_sqlite(path("bag/lodestone_0.db3"), SQLITE_OPEN_READONLY);
  SqliteStatement select(database.get(),
                         "SELECT messages.timestamp, messages.data FROM messages JOIN topics ON topics.id = topic_id "
                         "WHERE topics.name = '/lodestone/smoother/odometry' ORDER BY messages.timestamp");
  const Trajectory poses = trajectory("smoother");
  const auto covariances = read_covariances(path("run/smoother/covariance.csv"));
  ASSERT_EQ(covariances.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ASSERT_TRUE(select.step());
    EXPECT_EQ(select.integer(0), poses[i].time);
    const auto blob = select.blob(1);
    const std::string bytes(blob.begin(), blob.end());
    // CDR: four bytes, stamp, "map", "imu", then position, quaternion and covariance, then the twist.
    ASSERT_EQ(bytes.size(), 4U + 8 + 8 + 8 + 8 * (3 + 4 + 36 + 6 + 36));
    EXPECT_EQ(number_at<std::int32_t>(bytes, 4) * Time{1'000'000'000} + number_at<std::uint32_t>(bytes, 8),
              poses[i].time);
    EXPECT_EQ(bytes.substr(12, 16), std::string("\4\0\0\0map\0\4\0\0\0imu\0", 16));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(number_at<double>(bytes, 28 + 8 * axis), poses[i].pose.position(static_cast<int>(axis)));
    }
    EXPECT_NEAR(number_at<double>(bytes, 28 + 8 * 6), poses[i].pose.rotation.w(), 1e-12);
    // The position's variance is unchanged; rotations are about the map's axes.
    const Matrix6& covariance = covariances[i].covariance;
    EXPECT_NEAR(number_at<double>(bytes, 84), covariance(3, 3), 1e-15);
    const Matrix3 turned = poses[i].pose.rotation.toRotationMatrix();
    const Matrix3 rotation = turned * covariance.topLeftCorner<3, 3>() * turned.transpose();
    EXPECT_NEAR(number_at<double>(bytes, 84 + 8 * 35), rotation(2, 2), 1e-15);
    EXPECT_NEAR(number_at<double>(bytes, 84 + 8 * 22), rotation(0, 1), 1e-15);
  }
  EXPECT_FALSE(select.step());
}

TEST_F(ExportCommand, TrajectoriesAreReadBackByEvaluate) {
  for (const std::string to : {"tum", "euroc", "kitti"}) {
    const std::string out = path("poses." + to);
    expect_done("export " + path("run") + " --estimator smoother --to " + to + " --out " + out);
    const ProgramResult result =
        run_lodestone("evaluate " + out + " " + path("run/smoother/trajectory.tum") +
                      " --json --relation translation,angle" + (to == "kitti" ? " --times " + out + ".times" : ""));
    ASSERT_EQ(result.code, 0) << result.errors;
    const auto json = nlohmann::json::parse(result.output);
    EXPECT_EQ(json["pairs"], trajectory("smoother").size());
    EXPECT_LT(json["relations"]["translation"]["max"], 1e-7);
    EXPECT_LT(json["relations"]["angle"]["max"], 1e-5);
  }
}

TEST_F(ExportCommand, RefusesInOneLine) {
  const std::string run = path("run");
  expect_refused("export " + path("absent") + " --to mcap", "there is no such folder");
  expect_refused("export " + path("site") + " --to mcap", "has no summary.json");
  expect_refused("export " + run + " --to mcap --estimator smother", "did you mean 'smoother'?");
  expect_refused("export " + run + " --to mcap --estimator smoother,smoother", "'smoother' is named twice");
  expect_refused("export " + run + " --to kitti", "choose one of smoother, lidar-inertial with --estimator");
  expect_refused("export " + run + " --to kitti --log a.bag --estimator smoother", "has no scans");
  expect_refused("export " + run + " --to mcap --out " + path("run/summary.json"), "among the results of");
  expect_refused("export " + run + " --to mcap --out " + path("m.bag"), "expected a name that ends in .mcap");
  expect_refused("export " + run + " --to mcap --out " + path("run/smoother/x.mcap"), "among the results of");
  fs::create_directory(path("killed"));
  fs::create_directory(path("killed/checkpoint"));
  expect_refused("export " + path("killed") + " --to mcap", "is not finished");
  {
    const FolderLock running(path("killed"));
    expect_refused("export " + path("killed") + " --to mcap", "wait until that run ends");
  }
  EXPECT_FALSE(fs::exists(path("killed/export.mcap")));
}

TEST_F(ExportCommand, AFailedExportLeavesNoFile) {
  fs::copy(path("run"), path("broken"), fs::copy_options::recursive);
  fs::remove(path("broken/export.mcap"));
  std::ofstream(path("broken/smoother/covariance.csv")) << "t_s\n1,2,3\n";
  expect_refused("export " + path("broken") + " --to mcap", "covariance.csv:2:");
  std::ofstream(path("file")) << "no folder";
  expect_refused("export " + path("run") + " --to mcap --out " + path("file/a.mcap"), "cannot create the folder");
  for (const auto& entry : fs::directory_iterator(path("broken"))) {
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(::testing::StartsWith("export")));
  }
}

}  // namespace
}  // namespace lodestone
