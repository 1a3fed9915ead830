#include "frontends/lidar/scan_sampling.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "frontends/simulation/beam_pattern.h"

namespace lodestone {
namespace {

/// A scan of a LiDAR that stands in a box of 2 x `half` metres, without noise.
LidarScan scan_of_box(simulation::LidarPattern pattern, const Vector3& half) {
  simulation::LidarOptions options;
  options.pattern = pattern;
  const simulation::BeamPattern beams(options);
  std::vector<Vector3> firing(static_cast<std::size_t>(beams.lines()));
  LidarScan scan;
  for (int f = 0; f < beams.firings(); ++f) {
    beams.directions(7, f, firing);
    for (int line = 0; line < beams.lines(); ++line) {
      const double range = half.cwiseQuotient(firing[line].cwiseAbs()).minCoeff();
      LidarPoint point;
      point.position = (range * firing[line]).cast<float>();
      point.offset_ns = static_cast<std::int32_t>(from_seconds(beams.seconds(0, f) - beams.seconds(0, 0)));
      point.ring = static_cast<std::uint16_t>(line);
      scan.points.push_back(point);
    }
  }
  scan.end = scan.points.back().offset_ns;
  return scan;
}

class SampledScan : public ::testing::TestWithParam<simulation::LidarPattern> {};

/// Nothing in the sampling knows of rings and columns: both patterns are thinned to one point a voxel, from all round and
/// from all of the scan's time. A rosette looks everywhere twice a scan, on its way down and up; of a voxel met twice the
/// first point is kept, so that the second half of the scan gives the smaller share (a quarter in this box).
TEST_P(SampledScan, KeepsOnePointAVoxelFromAllSidesAndTimes) {
  const LidarScan scan = scan_of_box(GetParam(), {12, 9, 2.5});
  const ScanSamplingOptions options;
  const auto kept = sample_scan(scan, LidarModel{}, options);
  EXPECT_GT(kept.size(), 1500U);
  EXPECT_LT(kept.size(), scan.points.size() / 2);
  std::set<std::tuple<int, int, int>> voxels;
  std::array<int, 8> sides{}, times{};
  std::int32_t last = 0;
  for (const LidarPoint& point : kept) {
    const Eigen::Vector3f v = (point.position / static_cast<float>(options.voxel_m)).array().floor();
    voxels.emplace(static_cast<int>(v.x()), static_cast<int>(v.y()), static_cast<int>(v.z()));
    const double turn = std::atan2(point.position.y(), point.position.x()) / (2.0 * std::numbers::pi) + 0.5;
    ++sides[static_cast<std::size_t>(turn * 8.0) % 8];
    ++times[static_cast<std::size_t>(8.0 * point.offset_ns / (static_cast<double>(scan.end) + 1.0))];
    EXPECT_GE(point.offset_ns, last);
    last = point.offset_ns;
  }
  EXPECT_NEAR(static_cast<double>(voxels.size()), static_cast<double>(kept.size()), 0.01 * kept.size());
  const double eighth = static_cast<double>(kept.size()) / 8.0;
  const bool turns_once = GetParam() == simulation::LidarPattern::rotating;
  for (int i = 0; i < 8; ++i) {
    EXPECT_GT(sides[i], 0.5 * eighth) << i;
    if (turns_once) EXPECT_GT(times[i], 0.5 * eighth) << i;
  }
  EXPECT_GT(times[4] + times[5] + times[6] + times[7], (turns_once ? 0.4 : 0.2) * static_cast<double>(kept.size()));
}

TEST_P(SampledScan, AtMostSoManyPointsAreSpreadOverTheScan) {
  const LidarScan scan = scan_of_box(GetParam(), {12, 9, 2.5});
  ScanSamplingOptions options;
  options.max_points = 500;
  const auto kept = sample_scan(scan, LidarModel{}, options);
  EXPECT_EQ(kept.size(), 500U);
  EXPECT_LT(kept.front().offset_ns, scan.end / 50);
  EXPECT_GT(kept.back().offset_ns, scan.end / 50 * 48);
}

INSTANTIATE_TEST_SUITE_P(Patterns, SampledScan,
                         ::testing::Values(simulation::LidarPattern::rotating, simulation::LidarPattern::rosette),
                         [](const auto& info) {
                           return info.param == simulation::LidarPattern::rotating ? "rotating" : "rosette";
                         });

}  // namespace
}  // namespace lodestone
