#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "tests/frontends/logs/test_files.h"
#include "tools/simulate/world.h"

namespace lodestone::simulation {
namespace {

constexpr const char* hall = R"(
name: hall
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 4, columns: 32}
  magnetometer_mounts:
    - {name: left, position_m: [0.3, 0.2, -0.08]}
solids:
  - {name: walls, shape: box, at_m: [0, 0, 2], size_m: [16, 12, 4]}
sequences:
  a: {waypoints_m: [[-6, -3], [5, -3]], speed: [[0, 1.5]]}
)";

std::string error_of(const std::string& world, const std::string& fault) {
  try {
    load_world(world, {"faults=[" + fault + "]"});
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(FaultMistakes, AreOneLineThatNamesTheRightKey) {
  const testing::TemporaryFolder folder;
  const std::string world = folder / "hall.yaml";
  std::ofstream(world) << hall;
  struct Case {
    const char* fault;
    const char* expected_text;
  };
  for (const Case& wrong : {
           Case{"{kind: hard_irn, magnetometer: left}", "did you mean 'hard_iron'?"},
           Case{"{magnetometer: left}", "the key 'kind' is missing"},
           Case{"{kind: hard_iron, magnetometer: left, ofset_ut: [1, 2, 3]}", "did you mean 'offset_ut'?"},
           Case{"{kind: hard_iron, magnetometer: left}", "the key 'offset_ut' is missing"},
           Case{"{kind: hard_iron, magnetometer: left, offset_ut: [1, 2]}", "a list of 3 numbers"},
           Case{"{kind: dead, magnetometer: lft}", "did you mean 'left'?"},
           Case{"{kind: dead, magnetometer: [left, left]}", "named twice"},
           Case{"{kind: dead, magnetometer: []}", "names no magnetometer"},
           Case{"{kind: dead, magnetometer: left, begin_s: 3, end_s: 2}", "end_s must be more than begin_s"},
           Case{"{kind: dead, magnetometer: left, begin_s: -3}", "at least 0"},
           Case{"{kind: soft_iron, magnetometer: left}", "expected either matrix"},
           Case{"{kind: soft_iron, magnetometer: left, matrix: [1, 2, 3]}", "a list of 3 numbers"},
           Case{"{kind: bias_drift, magnetometer: left}", "expected rate_ut_s"},
           Case{"{kind: saturated, magnetometer: left, limit_ut: 0}", "above 0"},
           Case{"{kind: spikes, magnetometer: left, rate_per_s: 2}", "the key 'size_ut' is missing"},
           Case{"{kind: lidar_outage, begin_s: 2}", "the key 'end_s' is missing"},
           Case{"{kind: lidar_outage, begin_s: 2, end_s: 3, scans: some}", "none or empty"},
           Case{"{kind: imu_gap, begin_s: 2, end_s: 3, magnetometer: left}", "unknown key 'magnetometer'"},
           Case{"{kind: imu_bias_jump, at_s: 2}", "expected gyroscope_rad_s"},
           Case{"{kind: passing_steel, from_m: [0, 0, 0], to_m: [1, 0, 0]}", "the key 'begin_s' is missing"},
           Case{"{kind: clock_offset, sensor: lidr, offset_s: 0.1}", "did you mean 'lidar'?"},
           Case{"{kind: clock_offset, sensor: lidar, offset_s: 100}", "within"},
       }) {
    const std::string error = error_of(world, wrong.fault);
    EXPECT_NE(error.find(wrong.expected_text), std::string::npos) << wrong.fault << " gives: " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_NE(error.find("faults"), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace lodestone::simulation
