// Pictures of made-up runs: a tunnel drive in which one method loses track, and corner cases. To inspect them, set
// LODESTONE_KEEP_PICTURES to a folder.
#include "tools/plotting/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/tools/program_runner.h"
#include "tools/plotting/axes.h"

namespace lodestone {
namespace {

MagneticMap made_up_map(double width, double height) {
  FieldGrid grid;
  grid.resolution_m = 0.2;
  grid.columns = static_cast<int>(width / grid.resolution_m) + 1;
  grid.rows = static_cast<int>(height / grid.resolution_m) + 1;
  grid.origin = {-2.0, -0.5 * height};
  grid.heights_m = {0.3};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double x = 0.2 * column;
      const double y = 0.2 * row;
      const bool hole = std::hypot(x - 20.0, y - 1.0) < 0.7;
      const auto value =
          static_cast<float>(48.0 + 12.0 * std::sin(0.9 * x) * std::cos(0.8 * y) + 6.0 * std::sin(2.1 * x));
      nodes.emplace_back(0.2F * value, 0.1F * value, hole ? NAN : 0.97F * value, 0.4F);
    }
  }
  return MagneticMap(grid, nodes, 10.0);
}

struct MadeUpRun {
  Trajectory truth;
  std::vector<PictureSeries> series;
};

MadeUpRun made_up_run() {
  MadeUpRun run;
  constexpr int kScans = 600;
  run.series.resize(3);
  run.series[0].name = "smoother";
  run.series[1].name = "ieskf";
  run.series[2].name = "lidar-inertial";
  for (int i = 0; i < kScans; ++i) {
    const double t = 0.1 * i;
    Pose pose;
    pose.position = {t, 0.6 * std::sin(0.25 * t), 0.3};
    run.truth.push_back({from_seconds(t), pose});
    const bool degenerate = t > 15.0 && t < 45.0;
    for (std::size_t k = 0; k < 3; ++k) {
      PictureSeries& one = run.series[k];
      double error = 0.01 + 0.008 * static_cast<double>(k) + 0.006 * std::sin(1.7 * t + static_cast<double>(k)) +
                     (degenerate ? 0.02 * static_cast<double>(k + 1) : 0.0);
      if (k == 2 && t > 15.0) error += 0.12 * (t - 15.0);
      Pose estimate = pose;
      estimate.position.x() += error;
      one.trajectory.push_back({from_seconds(t), estimate});
      one.error_time_s.push_back(t);
      one.error_m.push_back(error);
      one.step_time_s.push_back(t);
      one.degenerate_directions.push_back(degenerate ? (std::fmod(t, 7.0) < 1.0 ? 2 : 1) : 0);
      if (k < 2) one.magnetic_weight.push_back(0.9 + 0.1 * std::sin(t) - (std::fmod(t, 9.0) < 0.5 ? 0.5 : 0.0));
    }
  }
  return run;
}

class Pictures : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& name) {
    const char* keep = std::getenv("LODESTONE_KEEP_PICTURES");
    return keep != nullptr ? std::filesystem::path(keep) / name : folder_ / name;
  }

  static void expect_png(const std::filesystem::path& path) {
    const std::string content = content_of(path);
    ASSERT_GT(content.size(), 1000U) << path;
    EXPECT_EQ(content.substr(1, 3), "PNG");
  }

  /// All three files of a picture exist.
  static void expect_picture(const std::filesystem::path& stem) {
    expect_png(stem.string() + ".png");
    EXPECT_EQ(content_of(stem.string() + ".pdf").substr(0, 5), "%PDF-");
    EXPECT_EQ(content_of(stem.string() + ".svg").substr(0, 5), "<?xml");
  }

  TemporaryFolder folder_;
};

TEST_F(Pictures, OfATunnelDrive) {
  const MadeUpRun run = made_up_run();
  const MagneticMap map = made_up_map(66.0, 4.0);
  draw_map_picture(file("map"), &map, run.truth, run.series);
  draw_error_picture(file("error"), run.series);
  draw_distribution_picture(file("distribution"), run.series);
  for (const char* name : {"map", "error", "distribution"}) expect_picture(file(name));
}

TEST_F(Pictures, AMapAloneIsCalledOneAndHasNoLegend) {
  const MadeUpRun run = made_up_run();
  const MagneticMap map = made_up_map(66.0, 4.0);
  draw_map_picture(file("alone"), &map, {}, {});
  draw_map_picture(file("driven"), &map, run.truth, run.series);
  const std::string alone = content_of(file("alone").string() + ".svg"),
                    driven = content_of(file("driven").string() + ".svg");
  EXPECT_THAT(alone, ::testing::HasSubstr(">Magnetic map<"));
  EXPECT_THAT(driven, ::testing::HasSubstr(">Magnetic map and trajectories<"));
  EXPECT_THAT(alone, ::testing::Not(::testing::HasSubstr("truth")));
  const auto height = [](const std::string& svg) { return std::stod(svg.substr(svg.find("height=\"") + 8)); };
  EXPECT_LT(height(alone), height(driven));
}

TEST_F(Pictures, AGeoreferencedMapHasWholeCoordinates) {
  FieldGrid grid{0.5, {431999.5, 4582999.5}, 81, 61, {0.3}};
  std::vector<Eigen::Vector4f> nodes(81 * 61, Eigen::Vector4f(20.0F, 0.0F, -40.0F, 0.4F));
  nodes[500].z() = -90.0F;
  const MagneticMap map(grid, nodes, 10.0);
  draw_map_picture(file("georeferenced"), &map, {}, {});
  const std::string svg = content_of(file("georeferenced").string() + ".svg");
  EXPECT_THAT(svg, ::testing::HasSubstr(">4583010<"));
  EXPECT_THAT(svg, ::testing::HasSubstr(">432010<"));
  EXPECT_THAT(svg, ::testing::HasSubstr(">≥ ")) << "one node is stronger than the scale";
  EXPECT_EQ(tick_text(432000.5), "432000.5");
  EXPECT_EQ(tick_text(0.1 * 3), "0.3");
}

TEST_F(Pictures, OfASquareSiteWithoutLostEstimates) {
  MadeUpRun run = made_up_run();
  run.series.pop_back();
  for (StampedPose& pose : run.truth) {
    pose.pose.position = {10.0 + 8.0 * std::cos(0.1 * to_seconds(pose.time)),
                          8.0 * std::sin(0.1 * to_seconds(pose.time)), 0.3};
  }
  for (PictureSeries& one : run.series) one.trajectory = run.truth;
  const MagneticMap map = made_up_map(24.0, 20.0);
  draw_map_picture(file("square_map"), &map, run.truth, run.series);
  draw_error_picture(file("square_error"), run.series);
  draw_distribution_picture(file("square_distribution"), run.series);
  expect_picture(file("square_map"));
}

TEST_F(Pictures, TheMapDrawsNoLineWhereAnEstimatorWasLost) {
  MadeUpRun run = made_up_run();
  run.series.resize(1);
  const auto lines = [&](const char* name) {
    draw_map_picture(file(name), nullptr, run.truth, run.series);
    const std::string svg = content_of(file(name).string() + ".svg");
    int count = 0;
    for (std::size_t at = svg.find("<path"); at != std::string::npos; at = svg.find("<path", at + 1)) ++count;
    return count;
  };
  const int whole = lines("whole_track");
  Trajectory& track = run.series.front().trajectory;
  track.erase(track.begin() + 200, track.begin() + 400);
  EXPECT_EQ(lines("parted_track"), whole + 1);
}

TEST_F(Pictures, OfAlmostNothing) {
  PictureSeries empty;
  empty.name = "smoother";
  draw_map_picture(file("empty_map"), nullptr, {}, {empty});
  draw_error_picture(file("empty_error"), {empty});
  draw_distribution_picture(file("empty_distribution"), {empty});
  draw_map_picture(file("no_field.png"), nullptr, made_up_run().truth, made_up_run().series);
  expect_png(file("no_field.png"));
  for (const char* name : {"empty_map", "empty_error", "empty_distribution"}) expect_picture(file(name));
}

TEST_F(Pictures, LostScansAreBeyondEveryErrorAndNamed) {
  PictureSeries half;
  half.name = "ieskf";
  half.error_time_s = {0.1, 0.2, 0.3, 0.4};
  half.error_m = {0.1, 0.2, NAN, NAN};
  PictureSeries all = half;
  all.error_time_s.resize(2);
  all.error_m.resize(2);
  const auto distribution = [&](const char* name, const PictureSeries& series) {
    draw_distribution_picture(file(name), {series});
    return content_of(file(name).string() + ".svg");
  };
  const std::string lost = distribution("half_lost", half);
  EXPECT_THAT(lost, ::testing::HasSubstr(">ieskf (lost in 2 of 4 scans)<"));
  EXPECT_THAT(lost, ::testing::HasSubstr("lost scans are beyond every error<"));
  EXPECT_THAT(distribution("never_lost", all), ::testing::Not(::testing::HasSubstr("lost")));
  // The curve of the lost one ends at 50 %: x is the right edge of the plan, y half of the height.
  EXPECT_THAT(lost, ::testing::HasSubstr("L860 344.71\""));
  draw_error_picture(file("half_error"), {half});
  const std::string error = content_of(file("half_error").string() + ".svg");
  EXPECT_THAT(error, ::testing::HasSubstr("no line where an estimator is lost<"));
  EXPECT_THAT(error, ::testing::HasSubstr(">number of degenerate directions, of six<"));
}

TEST_F(Pictures, AnEstimatorHasItsColourInAnyOrder) {
  PictureSeries smoother;
  smoother.name = "smoother";
  PictureSeries filter;
  filter.name = "lidar-inertial";
  const auto code = [](const Color& color) { return std::vector<int>{color.red, color.green, color.blue}; };
  EXPECT_EQ(code(colors_of({smoother, filter})[0]), code(colors_of({filter, smoother})[1]));
  EXPECT_EQ(code(colors_of({smoother, filter})[1]), code(colors_of({filter})[0]));
}

TEST(Ticks, AreRoundAndWithinTheRange) {
  EXPECT_EQ(round_ticks(0.0, 10.0, 5), (std::vector<double>{0.0, 2.0, 4.0, 6.0, 8.0, 10.0}));
  EXPECT_EQ(round_ticks(-0.5, 3.2, 4), (std::vector<double>{0.0, 1.0, 2.0, 3.0}));
  EXPECT_TRUE(round_ticks(1.0, 1.0, 4).empty());
  EXPECT_EQ(decade_ticks(0.01, 20.0).size(), 4U);
  EXPECT_DOUBLE_EQ((Scale{0.01, 100.0, true}.share(1.0)), 0.5);
  EXPECT_DOUBLE_EQ((Scale{0.01, 100.0, true}.share(-1.0)), 0.0);
}

}  // namespace
}  // namespace lodestone
