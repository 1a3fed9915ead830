#include "core/lidar/scan_sampling.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

#include "core/error.h"
#include "tools/simulate/beam_pattern.h"

namespace lodestone {
namespace {

/// A scan without noise of a LiDAR in a box of 2 x `half` metres.
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

/// Both patterns are thinned to about one point a voxel, from all sides and from all of the scan's time: a rosette
/// covers each direction twice a scan, on its way down and up.
TEST_P(SampledScan, KeepsAboutOnePointAVoxelFromAllSidesAndTimes) {
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
  // Points are drawn at random: a voxel may keep two or none, but most keep one.
  EXPECT_GT(voxels.size(), kept.size() / 2);
  const double eighth = static_cast<double>(kept.size()) / 8.0;
  const bool turns_once = GetParam() == simulation::LidarPattern::rotating;
  for (int i = 0; i < 8; ++i) {
    EXPECT_GT(sides[i], 0.5 * eighth) << i;
    if (turns_once) {
      EXPECT_GT(times[i], 0.5 * eighth) << i;
    }
  }
  EXPECT_GT(times[4] + times[5] + times[6] + times[7], 0.4 * static_cast<double>(kept.size()));
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

/// The mean height of the kept points of a wall, over several scans, in standard deviations; `distance_m`: of the wall.
double mean_height_sigmas(double distance_m) {
  constexpr double kNoise_m = 0.02;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, kNoise_m);
  double sum = 0.0;
  int count = 0;
  for (int repeat = 0; repeat < 20; ++repeat) {
    LidarScan scan;
    for (int column = 0; column < 512; ++column) {
      for (int row = 0; row < 32; ++row) {
        const double azimuth = (column - 255.5) / 512.0 * 2.0;
        const double elevation = (row - 15.5) / 32.0 * 0.7;
        const Vector3 ray(std::cos(azimuth), std::sin(azimuth), std::tan(elevation));
        const Vector3 unit = ray.normalized();
        LidarPoint point;
        point.position = (unit * (distance_m / unit.x() + noise(random))).cast<float>();
        point.offset_ns = 190'000 * column;
        point.ring = static_cast<std::uint16_t>(row);
        scan.points.push_back(point);
      }
    }
    for (const LidarPoint& point : sample_scan(scan, LidarModel{}, {})) {
      sum += point.position.x() - distance_m;
      ++count;
    }
  }
  return sum / count / (kNoise_m / std::sqrt(static_cast<double>(count)));
}

TEST(ScanSampling, AWallStandsWhereItStandsWhereverItsVoxelsEnd) {
  for (const double distance_m : {4.2, 4.21, 4.25, 4.35, 4.48, 4.5}) {
    EXPECT_LT(std::abs(mean_height_sigmas(distance_m)), 4.0) << distance_m;
  }
}

/// A scan of two LiDARs, alternating: at the origin, and 3 m behind it. Their points do not overlap.
LidarScan scan_of_two() {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  LidarScan scan;
  for (int i = 0; i < 20000; ++i) {
    LidarPoint point;
    point.lidar = static_cast<std::uint8_t>(i % 2);
    const float side = i % 2 == 0 ? 1.0F : -1.0F;
    point.position = {side * 6.0F, 4.0F * uniform(random), uniform(random)};
    point.offset_ns = 1000 * i;
    point.ring = static_cast<std::uint16_t>(i / 2 % 16);
    scan.points.push_back(point);
  }
  return scan;
}

std::vector<LidarModel> two_lidars() {
  std::vector<LidarModel> lidars(2);
  lidars[0].T_imu_lidar = {so3::exp(Vector3(0.1, -0.2, 2.0)), Vector3(0.3, 0.1, 0.5)};
  lidars[1].T_imu_lidar = lidars[0].T_imu_lidar * Pose{so3::exp(Vector3(0.0, 0.3, 3.0)), Vector3(-3.0, 0.0, 0.0)};
  return lidars;
}

TEST(ScanSampling, LimitsOfRangeAreThoseOfAPointsOwnLidar) {
  LidarScan scan = scan_of_two();
  for (LidarPoint& point : scan.points) point.lidar = static_cast<std::uint8_t>(point.position.y() > 0.0F);
  std::vector<LidarModel> lidars = two_lidars();
  lidars[0].min_range_m = 6.5;
  lidars[0].max_range_m = 7.0;
  lidars[1].min_range_m = 3.5;
  lidars[1].max_range_m = 9.3;
  const Vector3 origins[] = {Vector3::Zero(), Vector3(-3.0, 0.0, 0.0)};
  std::vector<std::int32_t> expected, found;
  for (const LidarPoint& point : scan.points) {
    const LidarModel& own = lidars[point.lidar];
    const double range = (point.position.cast<double>() - origins[point.lidar]).norm();
    if (range > own.min_range_m && range < own.max_range_m) expected.push_back(point.offset_ns);
  }
  for (const LidarPoint& point : sample_scan(scan, lidars, {0.0, 0})) found.push_back(point.offset_ns);
  EXPECT_GT(expected.size(), scan.points.size() / 10);
  EXPECT_LT(expected.size(), scan.points.size() * 9 / 10);
  EXPECT_EQ(found, expected);
}

/// Rings of two LiDARs are not one ring: far points of one LiDAR do not change the kept points of the other.
TEST(ScanSampling, ALidarIsThinnedAsIfItWereAlone) {
  LidarScan scan = scan_of_two(), alone = scan;
  std::erase_if(alone.points, [](const LidarPoint& point) { return point.lidar != 0; });
  const auto times_of_first = [](const std::vector<LidarPoint>& points) {
    std::vector<std::int32_t> times;
    for (const LidarPoint& point : points) {
      if (point.lidar == 0) times.push_back(point.offset_ns);
    }
    return times;
  };
  const std::vector<LidarModel> lidars = two_lidars();
  const std::vector<LidarPoint> both = sample_scan(scan, lidars, {});
  const std::vector<LidarPoint> first = sample_scan(alone, lidars.front(), {});
  EXPECT_GT(first.size(), 100U);
  EXPECT_LT(first.size(), alone.points.size() / 4);
  EXPECT_GT(both.size(), first.size() + 100U);
  EXPECT_EQ(times_of_first(both), times_of_first(first));
}

TEST(ScanSampling, APointOfAnUnknownLidarIsRefused) {
  EXPECT_THROW(sample_scan(scan_of_two(), LidarModel{}, {}), std::out_of_range);
}

INSTANTIATE_TEST_SUITE_P(Patterns, SampledScan,
                         ::testing::Values(simulation::LidarPattern::rotating, simulation::LidarPattern::rosette),
                         [](const auto& info) {
                           return info.param == simulation::LidarPattern::rotating ? "rotating" : "rosette";
                         });

TEST(ScanSamplingOptions, VoxelsAreZeroOrAtLeastACentimetre) {
  for (const double voxel_m : {0.0, 0.01, 0.3, 100.0}) {
    ScanSamplingOptions options;
    options.voxel_m = voxel_m;
    EXPECT_NO_THROW(options.check()) << voxel_m;
  }
  for (const double voxel_m : {-1.0, 1e-9, 1e9}) {
    ScanSamplingOptions options;
    options.voxel_m = voxel_m;
    EXPECT_THROW(options.check(), InputError) << voxel_m;
  }
}

}  // namespace
}  // namespace lodestone
