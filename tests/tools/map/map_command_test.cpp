#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;

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
         "--resolution: expected metres above 0, found -1");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --resolution 0"),
         "--resolution: expected metres above 0, found 0");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --max-sigma-ut -2"),
         "--max-sigma-ut: expected microtesla above 0");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --method curl-fre"), "curl-free");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --set regresion.seed=2"),
         "did you mean 'regression'");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(MapCommand, RequiresNeitherLidarNorImuInThePlatformFile) {
  const TemporaryFolder folder;
  const std::string in = folder.path().string() + "/";
  std::ofstream(in + "lane.yaml") << R"(
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
  expect_refused("run " + in + "survey.bag --platform " + in + "bare.yaml --cloud absent.pcd --out " + in + "run",
                 "the key 'lidar' is missing");
}

}  // namespace
}  // namespace lodestone
