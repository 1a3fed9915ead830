#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontends/maps/magnetic_map_file.h"
#include "tests/tools/program_runner.h"
#include "tools/simulate/magnetic_field.h"
#include "tools/simulate/world.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;

const std::string world_file = LODESTONE_SOURCE_DIR "/config/worlds/tunnel.yaml";

/// 2 × 1 m, with one node without field and one above the limit of sigma.
void write_map(const std::string& path) {
  FieldGrid grid{0.1, {20.0, -0.5}, 21, 11, {0.12}};
  std::vector<Eigen::Vector4f> nodes(21 * 11, Eigen::Vector4f(1.0F, 2.0F, 3.0F, 0.5F));
  nodes[5].setConstant(std::numeric_limits<float>::quiet_NaN());
  nodes[7][3] = 9.0F;
  write_magnetic_map(MagneticMap(grid, nodes, 2.0), {}, path);
}

TEST(MapTruthCommand, WritesTheWorldsFieldWhereTheMapHasField) {
  const TemporaryFolder folder;
  const std::string like = (folder / "field.yaml").string();
  const std::string out = (folder / "truth.yaml").string();
  write_map(like);
  const ProgramResult result = run_lodestone("map truth " + world_file + " --like " + like + " --out " + out);
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr(std::to_string(21 * 11 - 2) + " nodes"));
  const MagneticMap truth = read_magnetic_map(out);
  const simulation::World world = simulation::load_world(world_file);
  const simulation::MagneticField field(world.earth_field_ut, simulation::build_scene(world).sources);
  for (const int column : {0, 4, 20}) {
    const Eigen::Vector4f node = truth.node(0, 3, column);
    EXPECT_LT((node.head<3>().cast<double>() - field.field_ut({20.0 + 0.1 * column, -0.2, 0.12})).norm(), 1e-4);
    EXPECT_EQ(node[3], 0.0F);
  }
  EXPECT_TRUE(std::isnan(truth.node(0, 0, 5)[0]));
  EXPECT_TRUE(std::isnan(truth.node(0, 0, 7)[0]));
}

TEST(MapTruthCommand, EachMistakeIsOneLineAndCodeTwo) {
  const TemporaryFolder folder;
  const std::string like = (folder / "field.yaml").string();
  write_map(like);
  const auto expect = [](const ProgramResult& result, const std::string& part) {
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.errors, HasSubstr(part));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  };
  expect(run_lodestone("map truth /absent.yaml --like " + like + " --out " + (folder / "t.yaml").string()),
         "/absent.yaml");
  expect(run_lodestone("map truth " + world_file + " --like /absent.yaml --out " + (folder / "t.yaml").string()),
         "/absent.yaml");
  expect(run_lodestone("map truth " + world_file + " --like " + like + " --out " + like), "overwrite");
  expect(run_lodestone("map truth " + world_file + " --like " + like + " --out " + (folder / "t.txt").string()),
         ".yaml");
  write_map((folder / "other.yaml").string());
  expect(run_lodestone("map truth " + world_file + " --like " + like + " --out " + (folder / "other.yaml").string()),
         "other.yaml: the file exists; choose another name, or set --force");
  expect(run_lodestone("map truth " + world_file + " --scene monday --like " + like + " --out " +
                       (folder / "t.yaml").string()),
         "monday");
}

}  // namespace
}  // namespace lodestone
