// A robot at rest, with a LiDAR mounting that is wrong by a degree and some centimetres, in a map in which a quarter of
// the objects has moved and walls are doubled. Many correspondences of the first scans are wrong. They must not set the
// robot in motion.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <string>

#include "frontends/configuration/trajectory_file.h"
#include "tests/tools/program_runner.h"
#include "tools/writers/csv_table.h"

namespace lodestone {
namespace {

struct Start {
  std::string world;
  int sequence;
  int seed;
};

std::ostream& operator<<(std::ostream& out, const Start& start) {
  return out << start.world << ' ' << start.sequence << ", seed " << start.seed;
}

class RoughStart : public ::testing::TestWithParam<Start> {
 protected:
  const TemporaryFolder folder_;
};

TEST_P(RoughStart, LeavesTheRobotAtRest) {
  const std::string site = (folder_ / "site").string();
  const auto& [world, sequence, seed] = GetParam();
  const ProgramResult simulated =
      run_lodestone(fmt::format("simulate " LODESTONE_SOURCE_DIR
                                "/config/worlds/{}.yaml --sequence {} --reality rough --seed {} --duration 2 --out {}",
                                world, sequence, seed, site));
  ASSERT_EQ(simulated.code, 0) << simulated.errors;
  const std::string out = (folder_ / "run").string();
  const ProgramResult result = run_lodestone("run " + site + "/log.bag --platform " + site + "/platform.yaml --cloud " +
                                             site + "/cloud.pcd --initial-pose-from " + site + "/truth.tum --truth " +
                                             site + "/truth.tum --estimator smoother --out " + out);
  ASSERT_EQ(result.code, 0) << result.errors;
  const std::vector<double> errors_m = CsvTable(out + "/smoother/errors.csv").numbers("error_m");
  EXPECT_LT(*std::max_element(errors_m.begin(), errors_m.end()), 0.15);
  // In real time too: the robot stands still from the first scan on.
  const Vector3 place = read_tum(site + "/truth.tum").front().pose.position;
  for (const StampedPose& estimate : read_tum(out + "/smoother/causal.tum")) {
    EXPECT_LT((estimate.pose.position - place).norm(), 0.15) << to_seconds(estimate.time);
  }
  // No direction is degenerate, however rough the map is.
  const std::vector<double> degenerate = CsvTable(out + "/smoother/diagnostics.csv").numbers("degenerate_directions");
  EXPECT_EQ(*std::max_element(degenerate.begin(), degenerate.end()), 0.0);
}

// In the port, LiDAR sees 100 m far: the map's bends look like motion within the scan.
INSTANTIATE_TEST_SUITE_P(Seeds, RoughStart,
                         ::testing::Values(Start{"warehouse", 2, 2}, Start{"warehouse", 2, 3}, Start{"warehouse", 2, 5},
                                           Start{"seaport", 5, 8}));

// With a mounting that is wrong by a degree, neither scan nor readings fit at the true pose itself. A place 0.4 m along
// the walkway fits them better than that, and no better than the poses close to the true one.
TEST(RoughStartOnAFieldMap, KeepsTheTruePose) {
  const TemporaryFolder folder;
  const std::string site = (folder / "site").string();
  const ProgramResult simulated =
      run_lodestone("simulate " LODESTONE_SOURCE_DIR
                    "/config/worlds/walkway.yaml --sequence 7 --reality rough --seed 303 --duration 2 --out " +
                    site);
  ASSERT_EQ(simulated.code, 0) << simulated.errors;
  const ProgramResult mapped =
      run_lodestone("map magnetic " + site + "/survey.bag --trajectory " + site + "/survey.tum --platform " + site +
                    "/platform.yaml --out " + site + "/field.yaml");
  ASSERT_EQ(mapped.code, 0) << mapped.errors;
  const std::string out = (folder / "run").string();
  const ProgramResult result =
      run_lodestone("run " + site + "/log.bag --platform " + site + "/platform.yaml --cloud " + site +
                    "/cloud.pcd --magnetic " + site + "/field.yaml --initial-pose-from " + site +
                    "/truth.tum --truth " + site + "/truth.tum --estimator smoother --out " + out);
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, testing::Not(testing::HasSubstr("start_moved")));
  const std::vector<double> errors_m = CsvTable(out + "/smoother/errors.csv").numbers("error_m");
  EXPECT_LT(*std::max_element(errors_m.begin(), errors_m.end()), 0.15);
}

}  // namespace
}  // namespace lodestone
