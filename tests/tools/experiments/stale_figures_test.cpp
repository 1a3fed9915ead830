#include "tools/experiments/stale_figures.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "tests/tools/program_runner.h"

namespace lodestone::reproduce {
namespace {

/// 4 m x 1 m; from x = 2.5 m on the field is larger by `step_ut`, with a transition from 2.0 m on.
MagneticMap map_with_step(double step_ut) {
  FieldGrid grid;
  grid.resolution_m = 0.5;
  grid.columns = 9;
  grid.rows = 3;
  grid.heights_m = {0.1};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      nodes.emplace_back(20.0F + (column >= 5 ? static_cast<float>(step_ut) : 0.0F), 0.0F, -40.0F, 0.3F);
    }
  }
  return MagneticMap(grid, nodes, 10.0);
}

class StaleFigures : public ::testing::Test {
 protected:
  /// Six cells; the last one is off the map.
  std::filesystem::path cells(const std::string& places) const {
    const std::filesystem::path path = folder_ / "field_cells.csv";
    std::ofstream file(path);
    file << "x_m,y_m,z_m,place\n";
    const char* positions[] = {"0.5,0.5,0.1", "1.0,0.5,0.1", "3.0,0.5,0.1", "3.5,0.5,0.1", "3.7,0.5,0.1", "30,0.5,0.1"};
    for (std::size_t i = 0; i < places.size(); ++i) file << positions[i] << ',' << places[i] << '\n';
    return path;
  }
  TemporaryFolder folder_;
};

TEST_F(StaleFigures, CountWhatChangedWhatOfItIsReportedAndWhatIsReportedForNothing) {
  const auto figures = stale_figures(cells("010223"), map_with_step(20.0), map_with_step(0.0));
  EXPECT_EQ(figures.at("changed_cells"), 3.0);
  EXPECT_DOUBLE_EQ(figures.at("changed_found"), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(figures.at("unchanged_reported"), 0.5);
}

TEST_F(StaleFigures, OfTheLogsOwnMapNothingChangedAndWhatIsReportedIsAFalseAlarm) {
  const auto figures = stale_figures(cells("000010"), map_with_step(20.0), map_with_step(20.0));
  EXPECT_EQ(figures.at("changed_cells"), 0.0);
  EXPECT_EQ(figures.at("changed_found"), 1.0);
  EXPECT_DOUBLE_EQ(figures.at("unchanged_reported"), 0.2);
}

TEST_F(StaleFigures, ChangesBetweenTheBoundsDecideNothing) {
  const auto figures = stale_figures(cells("001100"), map_with_step(5.0), map_with_step(0.0));
  EXPECT_EQ(figures.at("changed_cells"), 0.0);
  EXPECT_EQ(figures.at("unchanged_reported"), 0.0);
}

TEST_F(StaleFigures, AFileThatIsNotThereIsNamed) {
  EXPECT_THROW(stale_figures(folder_ / "none.csv", map_with_step(0.0), map_with_step(0.0)), InputError);
}

}  // namespace
}  // namespace lodestone::reproduce
