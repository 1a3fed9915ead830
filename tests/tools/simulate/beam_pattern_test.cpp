#include "tools/simulate/beam_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/angles.h"
#include "core/error.h"

namespace lodestone::simulation {
namespace {

double elevation_deg(const Vector3& beam) {
  return std::asin(beam.z()) / degree;
}
double azimuth_deg(const Vector3& beam) {
  return std::atan2(beam.y(), beam.x()) / degree;
}

LidarOptions rosette() {
  LidarOptions options;
  options.pattern = LidarPattern::rosette;
  return options;
}

std::vector<Vector3> beams_of_scan(const BeamPattern& pattern, int scan) {
  std::vector<Vector3> beams;
  std::vector<Vector3> firing(pattern.lines());
  for (int f = 0; f < pattern.firings(); ++f) {
    pattern.directions(scan, f, firing);
    beams.insert(beams.end(), firing.begin(), firing.end());
  }
  return beams;
}

/// Share of the field of view's cells of one degree that are hit in the first `scans` scans.
double coverage(const BeamPattern& pattern, const LidarOptions& options, int scans) {
  const int rows = static_cast<int>(options.highest_elevation_deg - options.lowest_elevation_deg);
  std::vector<bool> hit(static_cast<std::size_t>(360 * rows));
  for (int scan = 0; scan < scans; ++scan) {
    for (const Vector3& beam : beams_of_scan(pattern, scan)) {
      const int row = std::clamp(static_cast<int>(elevation_deg(beam) - options.lowest_elevation_deg), 0, rows - 1);
      const int column = static_cast<int>(azimuth_deg(beam) + 180.0) % 360;
      hit[static_cast<std::size_t>(360 * row + column)] = true;
    }
  }
  return static_cast<double>(std::count(hit.begin(), hit.end(), true)) / static_cast<double>(hit.size());
}

TEST(Rosette, CoverageGrowsWithIntegrationTime) {
  const LidarOptions options = rosette();
  const BeamPattern pattern(options);
  const double after_0_1 = coverage(pattern, options, 1), after_0_5 = coverage(pattern, options, 5);
  const double after_1 = coverage(pattern, options, 10), after_3 = coverage(pattern, options, 30);
  RecordProperty("coverage_0_1_s", std::to_string(after_0_1));
  RecordProperty("coverage_0_5_s", std::to_string(after_0_5));
  RecordProperty("coverage_1_s", std::to_string(after_1));
  RecordProperty("coverage_3_s", std::to_string(after_3));
  EXPECT_GT(after_0_1, 0.5);
  EXPECT_GT(after_0_5, after_0_1 + 0.3);
  EXPECT_GT(after_1, after_0_5);
  EXPECT_GT(after_3, after_1);
  EXPECT_GT(after_3, 0.96);  // the rest is above the fan, where the fan is level
}

TEST(Rosette, NoScanRepeatsAnother) {
  const BeamPattern pattern(rosette());
  const auto first = beams_of_scan(pattern, 0);
  for (const int other : {1, 2, 10, 100, 1000}) {
    const auto beams = beams_of_scan(pattern, other);
    double nearest = 1e9;
    for (std::size_t i = 0; i < beams.size(); ++i) nearest = std::min(nearest, (beams[i] - first[i]).norm());
    EXPECT_GT(nearest / degree, 0.3) << other;  // no beam repeats an earlier direction of the scan
  }
}

TEST(Rosette, StaysWithinTheFieldOfViewAndReachesItsEnds) {
  LidarOptions options = rosette();
  options.lowest_elevation_deg = -10.0;
  options.highest_elevation_deg = 40.0;
  for (const LidarOptions& each : {rosette(), options}) {
    const BeamPattern pattern(each);
    double lowest = 90.0, highest = -90.0;
    for (int scan = 0; scan < 20; ++scan) {
      for (const Vector3& beam : beams_of_scan(pattern, scan)) {
        ASSERT_NEAR(beam.norm(), 1.0, 1e-12);
        lowest = std::min(lowest, elevation_deg(beam));
        highest = std::max(highest, elevation_deg(beam));
      }
    }
    EXPECT_GE(lowest, each.lowest_elevation_deg - 1e-6);
    EXPECT_LE(highest, each.highest_elevation_deg + 1e-6);
    EXPECT_LT(lowest, each.lowest_elevation_deg + 0.1);
    EXPECT_GT(highest, each.highest_elevation_deg - 0.1);
  }
}

/// Values measured from the published pattern: see beam_pattern.cpp.
TEST(Rosette, TurnsAndNodsAsThePublishedPattern) {
  const BeamPattern pattern(rosette());
  std::vector<Vector3> firing(4), later(4);
  // 282 firings are one turn.
  pattern.directions(0, 1000, firing);
  pattern.directions(0, 1282, later);
  EXPECT_NEAR(std::remainder(azimuth_deg(firing[1]) - azimuth_deg(later[1]), 360.0), 0.0, 1.0);
  pattern.directions(0, 1001, later);
  EXPECT_NEAR(azimuth_deg(later[1]) - azimuth_deg(firing[1]), -1.28, 0.2);
  // Lines have the opposite vertical order on the other side.
  int reversed = 0, upright = 0;
  for (int f = 0; f < pattern.firings(); ++f) {
    pattern.directions(0, f, firing);
    const double azimuth = azimuth_deg(firing[1]);
    if (std::abs(azimuth) < 10.0) upright += elevation_deg(firing[0]) < elevation_deg(firing[3]) - 6.0 ? 1 : -1;
    if (std::abs(azimuth) > 170.0) reversed += elevation_deg(firing[0]) > elevation_deg(firing[3]) + 6.0 ? 1 : -1;
  }
  EXPECT_GT(std::abs(upright), 200);
  EXPECT_GT(reversed * upright, 0);
}

TEST(Rosette, OptionsThatCannotBeAreRefused) {
  const auto refused = [](auto change) {
    LidarOptions options = rosette();
    change(options);
    EXPECT_THROW(options.check(), InputError);
  };
  EXPECT_NO_THROW(rosette().check());
  refused([](LidarOptions& o) { o.points_per_second = 100001.0; });
  refused([](LidarOptions& o) { o.points_per_second = 0.0; });
  refused([](LidarOptions& o) { o.highest_elevation_deg = 89.0; });
  refused([](LidarOptions& o) { o.lowest_elevation_deg = 50.0; });
}

}  // namespace
}  // namespace lodestone::simulation
