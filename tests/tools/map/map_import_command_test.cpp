#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "frontends/maps/magnetic_map_file.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(MapImportCommand, WritesTheHousesFilesAndSaysWhatItTook) {
  const TemporaryFolder folder;
  const std::string table = (folder / "field.csv").string(), out = (folder / "new/field.yaml").string();
  std::ofstream(table) << "x,y,z,Bx,By,Bz\n0,0,0.1,2e-5,0,-4e-5\n0.2,0,0.1,2.1e-5,0,-4e-5\n0,0.2,0.1,2.2e-5,0,-4e-5\n0."
                          "2,0.2,0.1,2.3e-5,0,-4e-5\n";
  ProgramResult result = run_lodestone("map import " + table + " --out " + out + " --sigma-ut 0.5");
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("4 nodes with field of 2 x 2 every 0.2 m, at 0.100 m height"));
  EXPECT_THAT(result.output, HasSubstr("unit tesla, detected from the field's magnitude"));
  EXPECT_THAT(result.output, HasSubstr("no column of sigma: 0.5 uT for every node"));
  const MagneticMap map = read_magnetic_map(out);
  const auto value = map.query({0.1, 0.1, 0.1}, FieldInterpolation::bilinear);
  ASSERT_TRUE(value.has_value());
  EXPECT_LT((value->field_ut - Vector3(21.5, 0.0, -40.0)).norm(), 1e-4);
  EXPECT_NEAR(value->sigma_ut, 0.5, 1e-6);
  EXPECT_THAT(content_of(out), HasSubstr("unit_of_table: \"tesla\""));
  EXPECT_TRUE(std::filesystem::exists(folder / "new/field.png"));

  result = run_lodestone("map import " + table + " --out " + out + " --force --unit telsa");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("--unit: expected one of tesla, microtesla, nanotesla, gauss, milligauss, found "
                                       "'telsa'; did you mean 'tesla'?"));
  EXPECT_EQ(run_lodestone("map import " + table + " --out field.tif").code, 2);
  expect_refused("map import " + table + " --out " + out + " --force --height nan",
                 "--height: expected metres, found nan");
  result = run_lodestone("map diff " + table + " " + out + " --out " + (folder / "d").string());
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("convert this table with `lodestone map import`"));
}

TEST(MapImportCommand, SaysThatPositionsWereTakenForMetres) {
  const TemporaryFolder folder;
  const std::string table = (folder / "field.csv").string(),
                    call = "map import " + table + " --out " + (folder / "field.yaml").string();
  const std::string rows = "0,0,120,20,0,-40\n200,0,120,21,0,-40\n0,200,120,22,0,-40\n200,200,120,23,0,-40\n";
  std::ofstream(table) << "x,y,z,Bx,By,Bz\n" << rows;
  ProgramResult result = run_lodestone(call);
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(
      result.output,
      HasSubstr("warning: map.metres (1 times): positions are read as metres: 200 m along x and 200 m along y"));
  EXPECT_THAT(result.output, HasSubstr("name the columns x_m, y_m and z_m"));
  std::ofstream(table) << "x_m,y_m,z_m,Bx,By,Bz\n" << rows;
  expect_refused(call, "--out " + (folder / "field.yaml").string() + ": the file exists; choose another name");
  result = run_lodestone(call + " --force");
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, Not(HasSubstr("map.metres")));
  std::filesystem::remove(folder / "field.yaml");
  expect_refused(call, "field.tif: the file exists");
}

}  // namespace
}  // namespace lodestone
