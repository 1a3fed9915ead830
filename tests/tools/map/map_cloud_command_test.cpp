// `lodestone map cloud` as called by users, on a short simulated drive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/lidar/plane_map.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kRoom = R"(
name: room
earth_field_ut: [20, 0, -40]
start_time_s: 1700000000
sensors:
  lidar: {rows: 32, columns: 512, min_range_m: 0.3, max_range_m: 40}
cloud: {point_spacing_m: 0.06}
solids:
  - {shape: box, at_m: [0, 0, 1.5], size_m: [14, 10, 3]}
  - {shape: box, at_m: [2, 3, 1], size_m: [1, 2, 2]}
sequences:
  short: {waypoints_m: [[-2, -2], [3, -2]], speed: [[0, 1.5]], rest_s: 0.5}
)";

using Points = std::vector<Eigen::Vector3f>;

/// The room is simulated once for all tests, empty and with people.
class MapCloudCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::ofstream(path("room.yaml")) << kRoom;
    std::ofstream(path("people.yaml")) << kRoom << "reality: {people: 6}\n";
    expect_done("simulate " + path("room.yaml") + " --duration 3 --only log,cloud --out " + path("room"));
    expect_done("simulate " + path("people.yaml") + " --duration 3 --only log --out " + path("people"));
    expect_done("map cloud " + path("room/log.bag") + drive_options("room") + " --out " + path("map.pcd"));
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string path(const std::string& name) { return (*folder_ / name).string(); }

  static std::string drive_options(const std::string& site) {
    return " --trajectory " + path(site + "/truth.tum") + " --platform " + path(site + "/platform.yaml");
  }

  static std::string expect_done(const std::string& arguments) {
    const ProgramResult result = run_lodestone(arguments);
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.errors;
    return result.output;
  }

  static Points points_of(const std::string& name) {
    WarningLog warnings;
    return read_point_cloud(path(name), warnings);
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};

std::unique_ptr<TemporaryFolder> MapCloudCommand::folder_;

TEST_F(MapCloudCommand, TheMapIsThatOfTheSimulator) {
  PlaneMapOptions options;
  options.voxel_m = 0.5;
  const PlaneMap simulated(points_of("room/cloud.pcd"), options);
  const double range_noise_m = load_platform(path("room/platform.yaml")).suite.lidar.range_noise_m;
  double sum = 0.0;
  int count = 0;
  for (const Eigen::Vector3f& point : points_of("map.pcd")) {
    const Plane* plane = simulated.at(point);
    if (plane == nullptr) continue;
    sum += std::abs(static_cast<double>(plane->distance(point)));
    ++count;
  }
  ASSERT_GT(count, 20'000);
  EXPECT_LT(sum / count, range_noise_m);
}

TEST_F(MapCloudCommand, ARunLoadsTheMap) {
  const std::string output = expect_done("run " + path("room/log.bag") + " --platform " + path("room/platform.yaml") +
                                         " --cloud " + path("map.pcd") + " --initial-pose-from " +
                                         path("room/truth.tum") + " --estimator lidar-inertial --out " + path("run"));
  EXPECT_THAT(output, HasSubstr("planes"));
}

TEST_F(MapCloudCommand, PeopleDisappearUnlessTheyAreKept) {
  const auto people = [](const Points& points) {
    return std::count_if(points.begin(), points.end(), [](const Eigen::Vector3f& point) {
      return std::abs(point.x()) < 6.5F && point.y() > -4.5F && point.y() < 1.5F && point.z() > 0.3F &&
             point.z() < 2.5F;
    });
  };
  const std::string call = "map cloud " + path("people/log.bag") + drive_options("people") + " --out ";
  const std::string output = expect_done(call + path("empty.pcd"));
  EXPECT_THAT(expect_done(call + path("full.pcd") + " --keep-moving"), Not(HasSubstr("moving objects")));
  EXPECT_THAT(output, HasSubstr("moving objects: "));
  ASSERT_EQ(people(points_of("map.pcd")), 0) << "the room has nothing there";
  const auto kept = people(points_of("full.pcd"));
  ASSERT_GT(kept, 500);
  EXPECT_LT(people(points_of("empty.pcd")), kept / 4) << "those who pass during the last scans stay";
}

TEST_F(MapCloudCommand, PartsOfALogGiveTheMapOfTheWhole) {
  expect_done("convert " + path("room/log.bag") + " --to 1.4 --out " + path("first.bag"));
  expect_done("convert " + path("room/log.bag") + " --from 1.4 --out " + path("second.bag"));
  expect_done("map cloud " + path("first.bag") + " " + path("second.bag") + " --trajectory " + path("room/truth.tum") +
              drive_options("room") + " --threads 1 --out " + path("parts.pcd"));
  EXPECT_EQ(content_of(path("parts.pcd")), content_of(path("map.pcd")));
}

TEST_F(MapCloudCommand, GapsOfTheTrajectoryAreSkippedAndNamed) {
  Trajectory trajectory = read_trajectory(path("room/truth.tum"));
  const Time begin = trajectory.front().time;
  std::erase_if(trajectory, [begin](const StampedPose& pose) {
    return pose.time > begin + from_seconds(1.0) && pose.time < begin + from_seconds(1.6);
  });
  write_tum(path("gap.tum"), trajectory);
  const std::string output = expect_done("map cloud " + path("room/log.bag") + " --trajectory " + path("gap.tum") +
                                         " --platform " + path("room/platform.yaml") + " --out " + path("gap.pcd"));
  EXPECT_THAT(output, AllOf(HasSubstr("have no pose in " + path("gap.tum")), HasSubstr("1 gaps of 0.")));
  EXPECT_LT(points_of("gap.pcd").size(), points_of("map.pcd").size());
}

TEST_F(MapCloudCommand, AnExistingFileIsReplacedWithForceOnly) {
  const std::string out = path("existing.pcd");
  std::ofstream(out) << "mine";
  const std::string call = "map cloud " + path("room/log.bag") + drive_options("room") + " --out " + out;
  expect_refused(call, "--out " + out + ": the file exists; choose another name, or set --force to replace the file");
  EXPECT_EQ(content_of(out), "mine");
  expect_done(call + " --force");
  EXPECT_EQ(content_of(out), content_of(path("map.pcd")));
}

TEST_F(MapCloudCommand, EachMistakeIsOneLine) {
  const std::string log = path("room/log.bag"), out = " --out " + path("refused.pcd");
  const std::string good = "map cloud " + log + drive_options("room");
  expect_refused(good + " --out " + path("refused.ply"), "expected a name ending in .pcd");
  expect_refused(good + out + " --voxel-m 0", "--voxel-m: expected a number from 0.01 to 0.5, found 0");
  expect_refused(good + out + " --max-range 0.1", "correct these keys, or --max-range");
  expect_refused(good + out + " --min-points 1000", "lower --min-points");
  expect_refused("map cloud " + log + " " + log + drive_options("room") + out, "found 1 for 2 (log.bag, log.bag)");
  expect_refused("map cloud " + log + " " + path("room/../room/log.bag") + " --trajectory " + path("room/truth.tum") +
                     drive_options("room") + out,
                 "room/../room/log.bag: the log is given twice");

  Trajectory trajectory = read_trajectory(path("room/truth.tum"));
  for (StampedPose& pose : trajectory) pose.time += from_seconds(100.0);
  write_tum(path("late.tum"), trajectory);
  const std::string platform = " --platform " + path("room/platform.yaml") + out;
  expect_refused("map cloud " + log + " --trajectory " + path("late.tum") + platform, "is within the time of");
  for (StampedPose& pose : trajectory) pose.pose.position.x() += 5e5;
  write_tum(path("far.tum"), trajectory);
  expect_refused("map cloud " + log + " --trajectory " + path("far.tum") + platform, "give one with --origin");

  trajectory = read_trajectory(path("room/truth.tum"));
  Trajectory sparse;
  for (const StampedPose& pose : trajectory) {
    if (sparse.empty() || pose.time >= sparse.back().time + from_seconds(0.5)) sparse.push_back(pose);
  }
  write_tum(path("sparse.tum"), sparse);
  expect_refused("map cloud " + log + " --trajectory " + path("sparse.tum") + platform,
                 "the poses of " + path("sparse.tum") + " are 0.5 s apart (median); expected at most 0.25 s");
  for (StampedPose& pose : trajectory) pose.pose.position *= 1e3;
  write_tum(path("millimetres.tum"), trajectory);
  expect_refused("map cloud " + log + " --trajectory " + path("millimetres.tum") + platform,
                 "expected positions in metres, and less than 100 m/s");

  Platform other = load_platform(path("room/platform.yaml"));
  other.lidar.topic = "/other/points";
  save_platform(other, path("other.yaml"));
  expect_refused(
      "map cloud " + log + " --trajectory " + path("room/truth.tum") + " --platform " + path("other.yaml") + out,
      "/other/points");
  EXPECT_FALSE(std::filesystem::exists(path("refused.pcd")));
}

TEST_F(MapCloudCommand, HelpShowsTwoExamples) {
  const std::string help = expect_done("map cloud --help");
  EXPECT_THAT(help, AllOf(HasSubstr("--out /tmp/tunnel/map.pcd"), HasSubstr("--out /tmp/tunnel/coarse.pcd")));
}

}  // namespace
}  // namespace lodestone
