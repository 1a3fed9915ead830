// Figures of made-up runs. To inspect them, set LODESTONE_KEEP_PICTURES to a folder.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "core/error.h"
#include "tests/tools/program_runner.h"
#include "tools/plotting/error_distribution.h"
#include "tools/plotting/error_grid.h"
#include "tools/plotting/plan_figures.h"

namespace lodestone::figures {
namespace {

using testing::HasSubstr;

/// A drive of 140 s that LiDAR alone loses from 60 to 80 s when its range is short.
ErrorSeries made_up_errors(const std::string& method, double noise_ut, bool degenerate, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  ErrorSeries series;
  series.method = method;
  for (int i = 0; i < 1400; ++i) {
    const double t = 0.1 * i;
    double error = 0.02 + 0.006 * std::abs(normal(random));
    if (method == "lidar-inertial" && degenerate && t > 60.0)
      error += t < 80.0 ? 0.25 * (t - 60.0) : 5.0 * std::exp(80.0 - t);
    if (method == "magnetic")
      error = noise_ut * 0.05 * (1.0 + 0.5 * std::sin(0.3 * t)) + 0.03 * noise_ut * std::abs(normal(random));
    if (method == "ieskf") error *= 1.4;
    if (degenerate && t > 60.0 && t < 80.0 && method != "lidar-inertial") error += 0.01 * noise_ut;
    series.time_s.push_back(t);
    series.error_m.push_back(error);
  }
  return series;
}

PlanRaster made_up_raster(double width, double height, double peak) {
  PlanRaster raster{0.2, -0.5 * width, -0.5 * height, 0.0, {}};
  raster.values.create(static_cast<int>(height / 0.2) + 1, static_cast<int>(width / 0.2) + 1);
  for (int row = 0; row < raster.values.rows; ++row) {
    for (int column = 0; column < raster.values.cols; ++column) {
      const double x = raster.x_m + 0.2 * column;
      const double y = raster.y_m + 0.2 * row;
      double value = 0.3 + 0.2 * std::sin(x) * std::sin(1.3 * y);
      for (double car = -20.0; car < 25.0; car += 9.0) value += peak * std::exp(-std::hypot(x - car, y - 2.0) / 1.2);
      raster.values(row, column) = std::hypot(x - 12.0, y + 2.5) < 0.8 ? NAN : static_cast<float>(value);
    }
  }
  return raster;
}

/// The raster at one point.
double value_at(const PlanRaster& raster, double x, double y) {
  return values_at(raster, {x, y, 1.0, 1.0, {1, 1}})(0, 0);
}

std::vector<Vector3> loop(double a, double b, double wiggle = 0.0) {
  std::vector<Vector3> track;
  for (int i = 0; i <= 600; ++i) {
    const double angle = 2.0 * M_PI * i / 600.0;
    track.emplace_back(a * std::cos(angle), b * std::sin(angle) + wiggle * std::sin(17.0 * angle), 0.3);
  }
  return track;
}

class Figures : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& name) {
    const char* keep = std::getenv("LODESTONE_KEEP_PICTURES");
    return keep != nullptr ? std::filesystem::path(keep) / name : folder_ / name;
  }

  /// Draws twice: all three files exist both times, with the same bytes. Returns the SVG.
  template <class Draw>
  std::string drawn(const std::string& name, Draw draw) {
    draw(file(name));
    draw(folder_ / "again");
    EXPECT_EQ(content_of(file(name + ".png")).substr(1, 3), "PNG");
    EXPECT_EQ(content_of(file(name + ".pdf")).substr(0, 5), "%PDF-");
    for (const std::string ending : {".png", ".pdf", ".svg"}) {
      EXPECT_EQ(content_of(file(name + ending)), content_of(folder_ / ("again" + ending))) << ending;
    }
    return content_of(file(name + ".svg"));
  }

  TemporaryFolder folder_;
};

TEST_F(Figures, ErrorOverTimeInAGridOfCases) {
  ErrorGrid grid{{"noise 1 µT", "noise 5 µT"}, {"range 100 m", "range 10 m"}, {}};
  for (const double noise : {1.0, 5.0}) {
    for (const bool degenerate : {false, true}) {
      ErrorPanel panel;
      for (const char* method : {"lidar-inertial", "magnetic", "ieskf", "smoother"}) {
        panel.series.push_back(made_up_errors(method, noise, degenerate, 3));
      }
      if (degenerate) panel.degenerate = {{60.0, 80.0}};
      grid.panels.push_back(panel);
    }
  }
  const std::string svg = drawn("error_grid", [&](const auto& path) { draw_error_grid(path, grid); });
  for (const char* text :
       {"noise 1 µT", "range 10 m", "lidar-inertial", "LiDAR degenerate", "time, s", "position error, m"}) {
    EXPECT_THAT(svg, HasSubstr(std::string(">") + text + "</text>"));
  }
  grid.panels.pop_back();
  EXPECT_THROW(draw_error_grid(file("wrong"), grid), std::invalid_argument);
  grid.panels.emplace_back();
  EXPECT_THAT(drawn("error_grid_hole", [&](const auto& path) { draw_error_grid(path, grid); }), HasSubstr(">no run<"));
}

TEST_F(Figures, ErrorOverTimeOfErrorsOfOneSizeIsLinear) {
  const ErrorGrid grid{{"seed 1"},
                       {"tunnel"},
                       {{{made_up_errors("smoother", 1.0, true, 1), made_up_errors("ieskf", 1.0, true, 2)}, {}}}};
  const std::string svg = drawn("error_single", [&](const auto& path) { draw_error_grid(path, grid); });
  EXPECT_THAT(svg, HasSubstr(">0</text>"));
}

TEST_F(Figures, DistributionsOfSeveralWorlds) {
  std::vector<DistributionPanel> panels;
  for (const char* world : {"warehouse", "tunnel", "seaport", "walkway", "corridor"}) {
    DistributionPanel panel{world, {}};
    for (const char* method : {"smoother", "ieskf", "lidar-inertial", "magnetic"}) {
      const auto seed = static_cast<unsigned>(panels.size() + 1);
      panel.methods.push_back(
          {method, made_up_errors(method, 1.0 + static_cast<double>(seed), seed != 3, seed).error_m, 0});
    }
    panels.push_back(panel);
  }
  drawn("distributions", [&](const auto& path) { draw_error_distributions(path, panels); });
  panels.resize(1);
  drawn("distribution_single", [&](const auto& path) { draw_error_distributions(path, panels); });
  drawn("distribution_none", [&](const auto& path) { draw_error_distributions(path, {}); });
}

TEST_F(Figures, ALostRunsDistributionEndsWhereItWasLost) {
  const MethodErrors half{"ieskf", {0.1, 0.2, 0.3}, 6};
  const std::string svg = drawn("distribution_lost", [&](const auto& path) {
    draw_error_distributions(path, {{"world", {half}}});
  });
  // Three of six scans: the last segment of the curve is at half height, the middle of the panel.
  MethodErrors whole = half;
  whole.expected = 0;
  EXPECT_NE(svg, drawn("distribution_whole", [&](const auto& path) {
              draw_error_distributions(path, {{"world", {whole}}});
            }));
}

TEST_F(Figures, DifferencesOfMaps) {
  std::vector<DifferencePanel> panels;
  for (const double peak : {30.0, 80.0, 19.0, 28.0, 54.0, 0.0}) {
    panels.push_back({"map " + std::to_string(panels.size() + 1), made_up_raster(56.0, 7.0, peak), loop(24.0, 2.0)});
  }
  const std::string svg = drawn("map_differences", [&](const auto& path) { draw_map_differences(path, panels); });
  EXPECT_THAT(svg, HasSubstr(">|ΔB|, µT</text>"));
  EXPECT_THAT(svg, HasSubstr(">largest "));
  for (DifferencePanel& panel : panels) panel.difference_ut = made_up_raster(50.0, 44.0, 40.0);
  drawn("map_differences_square", [&](const auto& path) { draw_map_differences(path, panels); });
  drawn("map_differences_none", [&](const auto& path) { draw_map_differences(path, {}); });
}

TEST_F(Figures, ResidualsOverTheDifference) {
  const PlanRaster background = made_up_raster(56.0, 7.0, 50.0);
  std::vector<ResidualPanel> panels{{"magnetic", {{}, loop(24.0, 2.0, 0.3), {}}},
                                    {"smoother", {{}, loop(24.0, 2.0), {}}}};
  for (ResidualPanel& panel : panels) {
    for (const Vector3& point : panel.track.position)
      panel.track.difference_ut.push_back(value_at(background, point.x(), point.y()));
  }
  const std::string svg =
      drawn("residuals", [&](const auto& path) { draw_residuals_over_difference(path, background, panels); });
  EXPECT_THAT(svg, HasSubstr("|measured − map|, µT"));
  drawn("residuals_none", [&](const auto& path) { draw_residuals_over_difference(path, {}, {}); });
}

TEST_F(Figures, WorldsWithTheirDrives) {
  std::vector<WorldPanel> panels{
      {"warehouse", made_up_raster(90.0, 80.0, 20.0), {{"1", loop(40.0, 30.0)}, {"2", loop(20.0, 25.0)}}},
      {"tunnel", made_up_raster(200.0, 12.0, 20.0), {{"3", loop(95.0, 2.0)}, {"4", loop(90.0, 1.0)}}},
      {"seaport", made_up_raster(300.0, 300.0, 20.0), {{"5", loop(100.0, 130.0)}}},
      {"walkway", made_up_raster(181.0, 23.0, 20.0), {{"6", loop(85.0, 8.0)}, {"7", loop(80.0, 4.0)}}},
      {"corridor", made_up_raster(15.0, 65.0, 20.0), {{"8", loop(5.0, 30.0)}, {"9", loop(3.0, 25.0)}}},
      {"carpark", made_up_raster(56.0, 7.0, 20.0), {{"log", loop(24.0, 2.0)}}}};
  const std::string svg = drawn("worlds", [&](const auto& path) { draw_worlds(path, panels); });
  for (const WorldPanel& panel : panels) EXPECT_THAT(svg, HasSubstr(">" + panel.title + "</text>"));
  drawn("worlds_none", [&](const auto& path) { draw_worlds(path, {{"nothing", {}, {}}}); });
}

TEST(PlanRaster, HasItsNodesValuesAndNoneOutside) {
  const PlanRaster raster{0.5, 1.0, 2.0, 0.0, (cv::Mat1f(2, 3) << 0.0F, 1.0F, 2.0F, 10.0F, 11.0F, NAN)};
  EXPECT_EQ(value_at(raster, 1.0, 2.0), 0.0);
  EXPECT_EQ(value_at(raster, 1.25, 2.25), 5.5);
  EXPECT_TRUE(std::isnan(value_at(raster, 1.75, 2.25)));
  EXPECT_TRUE(std::isnan(value_at(raster, 0.99, 2.0)));
  EXPECT_DOUBLE_EQ(quantile(raster.values, 1.0), 11.0);
  EXPECT_TRUE(std::isnan(value_at({}, 0.0, 0.0)));
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(PlanRaster, IsSampledFromBelowAndFromAbove) {
  const PlanRaster raster = made_up_raster(4.0, 3.0, 20.0);
  const PlanPoints from_below{raster.x_m, raster.y_m, 0.2, 0.2, raster.values.size()};
  const PlanPoints from_above{raster.x_m, raster.y_high(), 0.2, -0.2, raster.values.size()};
  cv::Mat1f below = values_at(raster, from_below);
  cv::Mat1f above = values_at(raster, from_above, RasterInterpolation::nearest);
  for (int row = 0; row < below.rows; ++row) {
    for (int column = 0; column < below.cols; ++column) {
      EXPECT_NEAR(below(row, column), raster.values(row, column), 1e-4);
      EXPECT_EQ(above(below.rows - 1 - row, column), raster.values(row, column));
    }
  }
  EXPECT_EQ(value_at(raster, raster.x_high(), raster.y_high()), raster.values(below.rows - 1, below.cols - 1));
}

TEST(PlanRaster, OfTwoMapsIsTheNormOfTheirDifference) {
  FieldGrid grid;
  grid.resolution_m = 1.0;
  grid.columns = grid.rows = 3;
  grid.heights_m = {0.0};
  const MagneticMap a(grid, std::vector<Eigen::Vector4f>(9, {3.0F, 0.0F, 44.0F, 0.1F}), 5.0);
  grid.origin = {1.0, 0.0};
  const MagneticMap b(grid, std::vector<Eigen::Vector4f>(9, {0.0F, 4.0F, 44.0F, 0.1F}), 5.0);
  const PlanRaster difference = difference_raster(a, b, 0.0);
  EXPECT_DOUBLE_EQ(difference.x_m, 1.0);
  EXPECT_FLOAT_EQ(static_cast<float>(value_at(difference, 1.5, 1.0)), 5.0F);
  EXPECT_TRUE(std::isnan(value_at(difference, 2.5, 1.0))) << "the reference ends at 2 m";
  EXPECT_FLOAT_EQ(strength_raster(b, 0.0).values(0, 0), std::hypot(4.0F, 44.0F));
}

class RunFolder : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  TemporaryFolder folder_;
};

TEST_F(RunFolder, GivesSeriesStretchesTracks) {
  write("errors.csv",
        "t_s,error_x_m,error_y_m,error_z_m,error_m,heading_error_deg,position_sigma_m\n"
        "1000.100000000,0.3,0.4,0,0.5,0.1,0.02\n1000.200000000,0,0,1,1,0.1,0.02\n");
  std::string diagnostics = "t_s,health,degenerate_directions\n";
  for (int i = 0; i < 100; ++i) {
    const bool degenerate = (i >= 20 && i < 30) || (i >= 33 && i < 40) || i == 80;
    diagnostics +=
        std::to_string(1000 + i / 10) + "." + std::to_string(i % 10) + ",good," + (degenerate ? "1" : "0") + "\n";
  }
  write("diagnostics.csv", diagnostics);
  write("field_residuals.csv", "t_s,x_m,y_m,z_m,mean_difference_ut\n1000.5,1,2,0.3,7.5\n");
  write("trajectory.tum", "# x\n1000.1 1 2 3 0 0 0 1\n1000.2 2 2 3 0 0 0 1\n");
  const Time begin = begin_of(folder_.path());
  EXPECT_EQ(begin, from_seconds(1000.0));
  const ErrorSeries errors = read_error_series(folder_.path(), begin);
  EXPECT_EQ(errors.method, folder_.path().filename().string());
  ASSERT_EQ(errors.time_s.size(), 2U);
  EXPECT_NEAR(errors.time_s[1], 0.2, 1e-9);
  EXPECT_EQ(errors.error_m, (std::vector<double>{0.5, 1.0}));
  const auto intervals = read_degenerate_stretches(folder_.path(), begin);
  ASSERT_EQ(intervals.size(), 1U) << "the gap of 0.4 s is bridged, the single scan ignored";
  EXPECT_NEAR(intervals[0].first, 1.9, 1e-9);
  EXPECT_NEAR(intervals[0].second, 3.9, 1e-9);
  const ResidualTrack residuals = read_residuals(folder_.path(), begin);
  EXPECT_EQ(residuals.difference_ut, (std::vector<double>{7.5}));
  EXPECT_NEAR(residuals.time_s[0], 0.5, 1e-9);
  EXPECT_EQ(read_track(folder_.path()).size(), 2U);
}

TEST_F(RunFolder, NamesWhatIsMissing) {
  EXPECT_THROW(begin_of(folder_.path()), InputError);
  EXPECT_THROW(read_error_series(folder_.path(), 0), InputError);
  write("diagnostics.csv", "t_s,degenerate_directions\n");
  EXPECT_THROW(begin_of(folder_.path()), InputError);
}

}  // namespace
}  // namespace lodestone::figures
