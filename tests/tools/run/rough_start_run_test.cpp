// A robot at rest, with a LiDAR mounting that is wrong by a degree and some centimetres, in a map in which a quarter of
// the objects has moved. Most correspondences of the first scan are wrong. They must not set the robot in motion.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/tools/program_runner.h"
#include "tools/writers/csv_table.h"

namespace lodestone {
namespace {

class RoughStart : public ::testing::TestWithParam<int> {
 protected:
  const TemporaryFolder folder_;
};

TEST_P(RoughStart, LeavesTheRobotAtRest) {
  const std::string site = (folder_ / "site").string();
  const ProgramResult simulated = run_lodestone("simulate " LODESTONE_SOURCE_DIR
                                                "/config/worlds/warehouse.yaml --sequence 2 --reality rough --seed " +
                                                std::to_string(GetParam()) + " --duration 2 --out " + site);
  ASSERT_EQ(simulated.code, 0) << simulated.errors;
  const std::string out = (folder_ / "run").string();
  const ProgramResult result = run_lodestone("run " + site + "/log.bag --platform " + site + "/platform.yaml --cloud " +
                                             site + "/cloud.pcd --initial-pose-from " + site + "/truth.tum --truth " +
                                             site + "/truth.tum --estimator smoother --out " + out);
  ASSERT_EQ(result.code, 0) << result.errors;
  const std::vector<double> errors_m = CsvTable(out + "/smoother/errors.csv").numbers("error_m");
  EXPECT_LT(*std::max_element(errors_m.begin(), errors_m.end()), 0.15);
  // The motion estimated from the first scan agrees with the second scan.
  const std::vector<double> nis = CsvTable(out + "/smoother/diagnostics.csv").numbers("lidar_nis");
  ASSERT_GT(nis.size(), 10U);
  EXPECT_LT(nis[1], 4.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RoughStart, ::testing::Values(1, 3));

}  // namespace
}  // namespace lodestone
