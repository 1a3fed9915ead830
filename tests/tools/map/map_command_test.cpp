#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kLane = R"(
name: lane
start_time_s: 1700000000
earth_field_ut: [20, 0, -40]
sensors:
  magnetometer_mounts:
    - {name: front, position_m: [0.3, 0.2, -0.08]}
    - {name: rear, position_m: [-0.3, -0.2, -0.08], rotation_rpy_deg: [0, 0, 180]}
survey: {lateral_offsets_m: [-0.3, 0.0, 0.3]}
solids:
  - {shape: rectangle, size_m: [12, 8], steel: [{kind: rods, from_m: [-4, -3, -0.6], to_m: [6, 3, -0.4],
     density_per_m2: 1.5, length_m: [0.5, 1.5], moment_sigma_a_m2: 30}]}
sequences:
  short: {waypoints_m: [[-2, 0], [2, 0]], speed: [[0, 1.0]]}
)";

TEST(MapCommand, HelpShowsTwoExamplesAndEveryOption) {
  const ProgramResult help = run_lodestone("map magnetic --help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.output, HasSubstr("--out /tmp/tunnel/field.yaml"));
  EXPECT_THAT(help.output, HasSubstr("--out /tmp/tunnel/coarse.yaml"));
  EXPECT_THAT(help.output, HasSubstr("regression.window_points"));
  EXPECT_THAT(help.output, HasSubstr("--method curl-free"));
}

TEST(MapCommand, EachMistakeIsOneLineAndCodeTwo) {
  const TemporaryFolder folder;
  const std::string files = " --trajectory /absent.tum --platform /absent.yaml --out ";
  const std::string out = (folder / "field.yaml").string();
  const auto expect = [](const ProgramResult& result, const std::string& part) {
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.errors, HasSubstr(part));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  };
  expect(run_lodestone("map magnetic /absent.bag" + files + out), "/absent.yaml");
  expect(run_lodestone("map magnetic /absent.bag" + files + (folder / "field.txt").string()), ".yaml");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --resolution -1"),
         "--resolution: expected a number from 0.005 to 10, found -1");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --resolution 0.001"),
         "--resolution: expected a number from 0.005 to 10, found 0.001");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --max-sigma-ut -2"),
         "--max-sigma-ut: expected microtesla above 0");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --method curl-fre"),
         "lodestone: --method: expected one of s-gpr, curl-free, found 'curl-fre'; did you mean 'curl-free'?");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --set regresion.seed=2"),
         "did you mean 'regression'");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(MapCommand, RequiresNeitherLidarNorImuInThePlatformFile) {
  const TemporaryFolder folder;
  const std::string in = folder.path().string() + "/";
  std::ofstream(in + "lane.yaml") << kLane;
  ASSERT_EQ(run_lodestone("simulate " + in + "lane.yaml --only survey --out " + in).code, 0);
  // The file without the blocks of LiDAR and IMU: a line without indentation begins the next block.
  std::istringstream lines(content_of(in + "platform.yaml"));
  std::ofstream bare(in + "bare.yaml");
  bool kept = true;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(" ")) kept = line != "lidar:" && line != "imu:";
    if (kept) bare << line << "\n";
  }
  bare.close();
  for (const std::string name : {"platform", "bare"}) {
    const ProgramResult result =
        run_lodestone("map magnetic " + in + "survey.bag --trajectory " + in + "survey.tum --platform " + in + name +
                      ".yaml --out " + in + "of-" + name + ".yaml");
    ASSERT_EQ(result.code, 0) << result.errors;
  }
  EXPECT_EQ(content_of(in + "of-platform.tif"), content_of(in + "of-bare.tif"));
  const std::string call = "map magnetic " + in + "survey.bag --trajectory " + in + "survey.tum --platform " + in +
                           "platform.yaml --out " + in;
  expect_refused(call + "of-bare.yaml", "of-bare.yaml: the file exists; choose another name, or set --force");
  expect_refused(call + "new.yaml --platform-out " + in + "bare.yaml", "--platform-out " + in + "bare.yaml: the file");
  expect_refused("run " + in + "survey.bag --platform " + in + "bare.yaml --cloud absent.pcd --out " + in + "run",
                 "the key 'lidar' is missing");
}

TEST(MapCommand, FindsAWrongHardIronAndWritesThePlatformFile) {
  const TemporaryFolder folder;
  const std::string in = folder.path().string() + "/";
  std::ofstream(in + "lane.yaml") << kLane;
  ASSERT_EQ(run_lodestone("simulate " + in + "lane.yaml --only survey --out " + in).code, 0);
  const Platform truth = load_platform(in + "platform.yaml");
  Platform wrong = truth;
  wrong.magnetometers[0].hard_iron_ut += Vector3(4.0, -3.0, 0.0);
  wrong.magnetometers[0].soft_iron_correction(0, 0) = 1.02;
  save_platform(wrong, in + "wrong.yaml");
  const auto build = [&in](const std::string& name) {
    const ProgramResult result = run_lodestone(
        "map magnetic " + in + "survey.bag --trajectory " + in + "survey.tum --platform " + in + name + ".yaml --out " +
        in + "of-" + name + ".yaml --platform-out " + in + name + "-out.yaml --set offset_sigma_ut=5");
    EXPECT_EQ(result.code, 0) << result.errors;
    return result.output;
  };
  EXPECT_THAT(build("platform"), HasSubstr("none, since they would not predict held-out readings better"));
  EXPECT_EQ(content_of(in + "platform-out.yaml"), content_of(in + "platform.yaml"));
  EXPECT_THAT(build("wrong"), HasSubstr("  front            "));
  const Platform found = load_platform(in + "wrong-out.yaml");
  for (std::size_t j = 0; j < 2; ++j) {
    const Vector3 error = found.magnetometers[j].hard_iron_ut - truth.magnetometers[j].hard_iron_ut;
    EXPECT_LT(error.head<2>().norm(), 1.5) << error.transpose();  // of 5 µT, on lanes of 4 m along one axis
  }
  EXPECT_THAT(content_of(in + "of-wrong.yaml"), HasSubstr("subtracted_offset_0"));
}

/// Copies the readings of a survey; `moved` changes their times.
template <class Moved>
void copy_survey(const std::string& from, const Platform& platform, const std::string& to, const Moved& moved) {
  WarningLog warnings;
  BagSource source(from, platform, warnings, {.lidar = false, .imu = false, .magnetometers = true});
  ros1::BagWriter writer(to, Codec::none);
  for (Measurement measurement; source.next(measurement);) {
    const auto& sample = std::get<MagneticSample>(measurement);
    ros1::MagneticFieldMessage message;
    message.stamp = moved(sample.time);
    for (int axis = 0; axis < 3; ++axis) {
      message.field_tesla[static_cast<std::size_t>(axis)] = 1e-6 * sample.field_ut[axis];
    }
    writer.write(platform.magnetometers[static_cast<std::size_t>(sample.magnetometer)].topic, message.stamp, message);
  }
  writer.close();
}

TEST(MapCommand, SeveralLogsAndPausesGiveTheMapOfOneLog) {
  const TemporaryFolder folder;
  const std::string in = folder.path().string() + "/";
  std::ofstream(in + "lane.yaml") << kLane;
  ASSERT_EQ(run_lodestone("simulate " + in + "lane.yaml --only survey --out " + in).code, 0);
  Trajectory trajectory = read_trajectory(in + "survey.tum");
  const std::size_t half = trajectory.size() / 2;
  const Time middle = trajectory[half].time;
  const double middle_s = std::round(to_seconds(middle - trajectory.front().time));
  const auto build = [&in](const std::string& logs, const std::string& out) {
    const ProgramResult result =
        run_lodestone("map magnetic " + logs + " --platform " + in + "platform.yaml --out " + in + out + ".yaml");
    EXPECT_EQ(result.code, 0) << result.errors;
    return result.output;
  };
  const std::string of = " --trajectory " + in + "survey.tum ";
  build(in + "survey.bag" + of, "whole");
  const ProgramResult none = run_lodestone("map magnetic " + in + "survey.bag" + of + "--platform " + in +
                                           "platform.yaml --max-sigma-ut 0.001 --out " + in + "none.yaml");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.errors, HasSubstr("increase --max-sigma-ut, or omit it"));
  EXPECT_THAT(none.output, Not(HasSubstr("median nan")));
  for (const std::string part : {"--to", "--from"}) {
    const ProgramResult result = run_lodestone("convert " + in + "survey.bag " + part + " " + std::to_string(middle_s) +
                                               " --out " + in + "part" + part + ".bag");
    ASSERT_EQ(result.code, 0) << result.errors;
  }
  build(in + "part--to.bag" + of + in + "part--from.bag" + of, "parts");
  EXPECT_EQ(content_of(in + "parts.tif"), content_of(in + "whole.tif"));
  EXPECT_THAT(content_of(in + "parts.yaml"), HasSubstr("part--to.bag, part--from.bag"));

  // An hour's pause in the middle, as if the recorder had been stopped.
  const auto moved = [middle](Time time) { return time <= middle ? time : time + from_seconds(3600.0); };
  copy_survey(in + "survey.bag", load_platform(in + "platform.yaml"), in + "paused.bag", moved);
  for (StampedPose& pose : trajectory) pose.time = moved(pose.time);
  StampedPose end_of_pause = trajectory[half];
  end_of_pause.time += from_seconds(3600.0);
  trajectory.insert(trajectory.begin() + static_cast<std::ptrdiff_t>(half) + 1, end_of_pause);
  write_tum(in + "paused.tum", trajectory);
  EXPECT_THAT(build(in + "paused.bag --trajectory " + in + "paused.tum", "paused"), Not(HasSubstr("log.broken_off")));
  const MagneticMap whole = read_magnetic_map(in + "whole.yaml"), paused = read_magnetic_map(in + "paused.yaml");
  const FieldGrid& grid = whole.grid();
  ASSERT_EQ(paused.grid().columns, grid.columns);
  ASSERT_EQ(paused.grid().rows, grid.rows);
  double largest_ut = 0.0;
  int nodes = 0;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector4f expected = whole.node(0, row, column), found = paused.node(0, row, column);
      ASSERT_EQ(found.allFinite(), expected.allFinite());
      if (!expected.allFinite()) continue;
      largest_ut = std::max<double>(largest_ut, (found - expected).head<3>().norm());
      ++nodes;
    }
  }
  EXPECT_GT(nodes, 100);
  EXPECT_LT(largest_ut, 0.01);
}

}  // namespace
}  // namespace lodestone
