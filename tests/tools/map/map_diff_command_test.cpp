#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/raster_file.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;

/// 4 × 3 m of (20, 0, −40) µT; `bump` µT more of B_z within 0.25 m of (1, 1).
void write_bump_map(const std::filesystem::path& path, double x, float bump) {
  FieldGrid grid{0.1, {x, 0.0}, 41, 31, {0.1}};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double distance = std::hypot(x + 0.1 * column - 1.0, 0.1 * row - 1.0);
      nodes.emplace_back(20.0F, 0.0F, -40.0F + (distance < 0.25 ? bump : 0.0F), 0.5F);
    }
  }
  write_magnetic_map(MagneticMap(grid, nodes, 2.0), {}, path.string());
}

TEST(MapDiffCommand, WritesFiguresPictureRasterAndPlaces) {
  const TemporaryFolder folder;
  write_bump_map(folder / "a.yaml", 0.0, 0.0F);
  write_bump_map(folder / "b.yaml", 0.0, 20.0F);
  const std::string out = (folder / "out").string();
  const ProgramResult result =
      run_lodestone("map diff " + (folder / "a.yaml").string() + " " + (folder / "b.yaml").string() + " --out " + out);
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("largest 20.000 uT"));
  EXPECT_THAT(result.output, HasSubstr("1 place above 10 uT, by more than the maps' errors at the level 0.05"));
  const auto json = nlohmann::json::parse(content_of(folder / "out/diff.json"));
  EXPECT_NEAR(json["largest_ut"], 20.0, 1e-5);
  EXPECT_NEAR(json["compared_m2"], 41 * 31 * 0.01, 1e-9);
  EXPECT_NEAR(json["area_above_threshold_m2"], 21 * 0.01, 1e-9);  // 21 nodes are within 2.5 nodes of the centre
  EXPECT_NEAR(json["share_above_3_sigma"], 21.0 / (41 * 31), 1e-9);
  EXPECT_EQ(json["places_above_threshold"], 1);
  EXPECT_THAT(content_of(folder / "out/places.csv"), HasSubstr("\n1,1.000,1.000,0.21,20.000,20.000,"));
  EXPECT_THAT(content_of(folder / "out/places.csv"), HasSubstr(",0.707,"));  // 0.5 µT in each map
  for (const char* name : {"out/picture.png", "out/picture.pdf", "out/picture.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
  }

  const RasterFile raster((folder / "out/difference.tif").string());
  ASSERT_EQ(raster.pages(), 4);
  const cv::Mat1f size = raster.read(3, {0, 0, 41, 31});
  EXPECT_FLOAT_EQ(size(10, 10), 20.0F);
  EXPECT_FLOAT_EQ(size(20, 10), 0.0F);
  EXPECT_THAT(content_of(folder / "out/difference.yaml"), HasSubstr("image: \"difference.tif\""));
}

TEST(MapDiffCommand, ASignalLeavesAllFilesOrNone) {
  const TemporaryFolder folder;
  write_bump_map(folder / "a.yaml", 0.0, 0.0F);
  write_bump_map(folder / "b.yaml", 0.0, 20.0F);
  const std::string in = folder.path().string() + "/";
  // The signal comes with the first file; 9: the program had ended before.
  std::ofstream(folder / "call.sh")
      << LODESTONE_PROGRAM " map diff " << in << "a.yaml " << in << "b.yaml --out " << in
      << "out >/dev/null 2>&1 & until test -e " << in
      << "out/difference.tif || ! kill -0 $!; do :; done; kill -TERM $! || exit 9; wait $!";
  int code = 9;
  for (int attempt = 0; attempt < 50 && code == 9; ++attempt) {
    std::filesystem::remove_all(folder / "out");
    code = WEXITSTATUS(std::system(("bash " + in + "call.sh 2>/dev/null").c_str()));
  }
  EXPECT_EQ(code, 0);
  for (const char* name : {"picture.png", "picture.pdf", "picture.svg", "difference.yaml", "places.csv", "diff.json"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / "out" / name)) << name;
  }
}

TEST(MapDiffCommand, EachMistakeIsOneLineAndCodeTwo) {
  const TemporaryFolder folder;
  write_bump_map(folder / "a.yaml", 0.0, 0.0F);
  write_bump_map(folder / "far.yaml", 50.0, 0.0F);
  const std::string a = (folder / "a.yaml").string();
  const std::string out = " --out " + (folder / "out").string();
  expect_refused("map diff " + a + " " + (folder / "far.yaml").string() + out,
                 "y 0.00 to 3.00, z 0.10 to 0.10 m; compare maps of one site");
  expect_refused("map diff " + a + " /absent.yaml" + out, "/absent.yaml");
  expect_refused("map diff " + a + " " + a + out + " --threshold-ut 0", "--threshold-ut");
  expect_refused("map diff " + a + " " + a + out + " --level 1", "--level");
  std::string text = content_of(folder / "a.yaml");
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"unit: microtesla", "unit: gauss"}, {"frame: map", "frame: odom"}}) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    std::ofstream(folder / "b.yaml") << changed;
    expect_refused("map diff " + a + " " + (folder / "b.yaml").string() + out, to.substr(to.find(' ') + 1));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace lodestone
