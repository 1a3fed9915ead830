#include <gtest/gtest.h>

#include <fstream>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

/// Up to 100 days after time 0, a double represents whole nanoseconds: a PointCloud2 is then as accurate as a
/// CustomMsg.
constexpr const char* livox_office = R"(
name: office
start_time_s: 1000000
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {pattern: rosette, min_range_m: 0.1, max_range_m: 40}
cloud: {point_spacing_m: 0.1}
solids:
  - {shape: box, at_m: [0, 0, 1.5], size_m: [14, 10, 3]}
  - {shape: box, at_m: [2, 3, 1], size_m: [1, 2, 2]}
  - {shape: rectangle, at_m: [-3, 0, 1.5], size_m: [3, 4], rotation_rpy_deg: [0, 90, 0],
     transparency: 0.8, max_incidence_deg: 20}
sequences:
  short: {waypoints_m: [[-2, -2], [3, -2]], speed: [[0, 1.0]], rest_s: 1.0}
)";

TEST(LivoxRun, BothMessagesGiveTheSameTrajectory) {
  const TemporaryFolder folder;
  std::ofstream(folder / "office.yaml") << livox_office;
  std::string trajectories[2];
  const std::string formats[2] = {"pointcloud2", "livox_custom"};
  for (int i = 0; i < 2; ++i) {
    const std::string out = (folder / formats[i]).string();
    ProgramResult result = run_lodestone("simulate " + (folder / "office.yaml").string() + " --duration 4 --out " +
                                         out + " --only log,cloud --set sensors.lidar.message=" + formats[i]);
    ASSERT_EQ(result.code, 0) << result.errors;
    result = run_lodestone("run " + out + "/log.bag --platform " + out + "/platform.yaml --cloud " + out +
                           "/cloud.pcd --initial-pose-from " + out + "/truth.tum --truth " + out +
                           "/truth.tum --estimator smoother --out " + out + "/run");
    ASSERT_EQ(result.code, 0) << result.errors;
    trajectories[i] = content_of(out + "/run/smoother/trajectory.tum");
  }
  EXPECT_GT(trajectories[0].size(), 3000U);
  EXPECT_TRUE(trajectories[0] == trajectories[1]);
}

}  // namespace
}  // namespace lodestone
