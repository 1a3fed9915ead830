#include "tools/writers/error_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/geometry/so3.h"
#include "tests/tools/program_runner.h"
#include "tools/writers/csv_table.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

TEST(ErrorFile, HoldsWhatTheEstimateDiffersByAndReadsItBack) {
  PosePair pair;
  pair.time = 1403715529112143517;
  pair.estimate.position = {1.0, 2.0, 3.5};
  pair.truth.position = {0.7, 2.4, 3.5};
  pair.estimate.rotation = Quaternion(Eigen::AngleAxisd(0.02, Vector3::UnitZ()));
  Matrix6 covariance = Matrix6::Identity();
  covariance.bottomRightCorner<3, 3>().diagonal() = Vector3(0.01, 0.04, 0.04);
  const TemporaryFolder folder;
  write_errors(folder / "errors.csv", error_rows({pair}, {covariance}));
  EXPECT_THAT(
      content_of(folder / "errors.csv"),
      HasSubstr("t_s,error_x_m,error_y_m,error_z_m,error_m,heading_error_deg,position_sigma_m\n1403715529.112143517,"));
  const std::vector<ErrorRow> rows = read_errors(folder / "errors.csv");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].time, pair.time);
  EXPECT_LT((rows[0].position_m - Vector3(0.3, -0.4, 0.0)).norm(), 1e-9);
  EXPECT_NEAR(rows[0].norm_m, 0.5, 1e-9);
  EXPECT_NEAR(rows[0].heading_deg, 0.02 * 180.0 / M_PI, 1e-8);
  EXPECT_NEAR(rows[0].position_sigma_m, 0.3, 1e-9);
  EXPECT_THROW(error_rows({pair}, {}), std::invalid_argument);
}

TEST(CsvTable, NamesFileLineAndColumn) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) {
    std::ofstream(folder / "t.csv") << text;
    try {
      const CsvTable table(folder / "t.csv");
      table.stamps("t_s");
      table.numbers("error_m");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused("t_s,error_m\n# a comment\n1.5,nan\r\n"), "accepted");
  EXPECT_THAT(refused(""), HasSubstr("header row"));
  EXPECT_THAT(refused("t_s,error_m\n1,2,3\n"), HasSubstr("t.csv:2: expected 2 values"));
  EXPECT_THAT(refused("t_s,error_m\n1,2\n3,x\n"), HasSubstr("t.csv:3: error_m: expected a number, found 'x'"));
  EXPECT_THAT(refused("t_s,error\n1,2\n"), HasSubstr("expected a column 'error_m'"));
  EXPECT_THROW(CsvTable(folder / "none.csv"), InputError);
}

}  // namespace
}  // namespace lodestone
