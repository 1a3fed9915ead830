// The error between drives is estimated from draws, and the map's sigma with it is correct on an independent drive.
#include "core/mapping/drive_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/mapping/magnetic_map_builder.h"
#include "tests/core/mapping/drifting_survey.h"

namespace lodestone {
namespace {

using testing::drive_over;
using testing::DriveErrors;
using testing::SteelFloor;

std::vector<HeldOutCell> drawn_cells(const Vector3& sigma_ut, double position_sigma_m) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  std::vector<HeldOutCell> cells(4000);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    HeldOutCell& cell = cells[i];
    cell.position = {0.1 * static_cast<double>(i), 0.0, 0.0};
    cell.block = static_cast<int>(i / 30);
    cell.well_predicted = {true, true, true};
    for (int k = 0; k < 3; ++k) {
      cell.variance_ut2[k] = 0.25 + 0.25 * static_cast<double>(i % 3);
      cell.squared_slope[k] = std::pow(10.0 + 20.0 * static_cast<double>((i + static_cast<std::size_t>(k)) % 5), 2);
      const double variance = cell.variance_ut2[k] + sigma_ut[k] * sigma_ut[k] +
                              position_sigma_m * position_sigma_m * cell.squared_slope[k];
      cell.error_ut[k] = std::sqrt(variance) * normal(generator);
    }
  }
  return cells;
}

TEST(DriveErrorTest, FindsTheErrorsThatCellsWereDrawnFrom) {
  const DriveError found = fit_drive_error(drawn_cells({1.0, 2.0, 0.5}, 0.02), 1.5);
  EXPECT_NEAR(found.position_sigma_m, 0.02, 0.004);
  EXPECT_NEAR(found.sigma_ut.x(), 1.0, 0.2);
  EXPECT_NEAR(found.sigma_ut.y(), 2.0, 0.2);
  EXPECT_NEAR(found.sigma_ut.z(), 0.5, 0.25);
  EXPECT_LT(found.correlation_m, 0.05);  // the draws are independent
}

TEST(DriveErrorTest, IsZeroWhereThePredictionsSuffice) {
  const DriveError found = fit_drive_error(drawn_cells(Vector3::Zero(), 0.0), 1.5);
  EXPECT_TRUE(found.sigma_ut.isZero());
  EXPECT_EQ(found.position_sigma_m, 0.0);
  EXPECT_LT(found.correlation_m, 0.05);  // the draws are independent
}

TEST(DriveErrorTest, FindsTheCorrelationLengthOfAGaussMarkovProcess) {
  for (const double length_m : {0.1, 0.3, 0.8}) {
    std::mt19937_64 generator(6);
    std::normal_distribution<double> normal;
    std::vector<NormalizedError> errors;
    const double keep = std::exp(-0.05 / length_m);
    for (int block = 0; block < 300; ++block) {
      double value = normal(generator);
      for (int i = 0; i < 60; ++i) {
        errors.push_back({{0.05 * i, 1.0, 0.0}, block, value});
        value = keep * value + std::sqrt(1.0 - keep * keep) * normal(generator);
      }
    }
    EXPECT_NEAR(error_correlation_length(errors, 1.5), length_m, 0.15 * length_m);
  }
  EXPECT_EQ(error_correlation_length({}, 1.5), 0.0);
}

/// Normalized rms of the residuals of a drive against a map, each component; white noise is part of the sigma.
Vector3 residuals_over_sigma(const MagneticMap& map, const std::vector<FieldObservation>& drive, double* share_above) {
  Vector3 squares = Vector3::Zero();
  int count = 0, above = 0;
  for (const FieldObservation& reading : drive) {
    const auto value = map.query(reading.position, FieldInterpolation::bicubic);
    if (!value) continue;
    const Vector3 variance =
        (value->sigma_ut * map.errors().sigma_shares).cwiseAbs2().array() + reading.noise_ut * reading.noise_ut;
    const Vector3 ratio = (reading.field_ut - value->field_ut).cwiseAbs2().cwiseQuotient(variance);
    squares += ratio;
    ++count;
    above += ratio.sum() > 14.16;  // 99.73 % of χ² with three degrees of freedom
  }
  EXPECT_GT(count, static_cast<int>(drive.size() * 3 / 4));
  *share_above = static_cast<double>(above) / count;
  return (squares / count).cwiseSqrt();
}

TEST(DriveErrorTest, TheMapsSigmaIsHonestOnAnotherDrive) {
  for (const double position_m : {0.0, 0.01, 0.02}) {
    Vector3 squares = Vector3::Zero();
    double worst_without = 0.0;
    constexpr int floors = 3;
    for (int seed = 1; seed <= floors; ++seed) {
      const SteelFloor floor(static_cast<std::uint64_t>(seed));
      const DriveErrors errors{position_m, position_m > 0.0 ? 0.5 : 0.0, 0.3};
      const auto survey = drive_over(floor, 10, errors);
      const auto other = drive_over(floor, 11, errors, 0.08);
      double share = 0.0;
      const MagneticMapResult result = build_magnetic_map(survey, {});
      const Vector3 normalized = residuals_over_sigma(result.map, other, &share);
      squares += normalized.cwiseAbs2() / floors;
      EXPECT_LT(share, 0.02);
      if (position_m == 0.0) {
        EXPECT_EQ(result.fit.drive.position_sigma_m, 0.0);
      }
      MagneticMapOptions without;
      without.regression.calibration_block_m = 0.0;
      worst_without = std::max(worst_without,
                               residuals_over_sigma(build_magnetic_map(survey, without).map, other, &share).maxCoeff());
    }
    const Vector3 normalized = squares.cwiseSqrt();
    std::printf("positions err by %.2f m: normalized %.2f %.2f %.2f, without calibration up to %.2f\n", position_m,
                normalized.x(), normalized.y(), normalized.z(), worst_without);
    EXPECT_NEAR(normalized.norm() / std::sqrt(3.0), 1.0, 0.25);
    EXPECT_GT(normalized.minCoeff(), 0.6);  // the steel is not a draw from a stationary kernel
    EXPECT_LT(normalized.maxCoeff(), 1.35);
    if (position_m >= 0.01) {
      EXPECT_GT(worst_without, 1.6);
    }
  }
}

TEST(HeldOutBlocksTest, GoByWayAtAnySpeedAndStandstill) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  std::vector<FieldObservation> observations;
  double x = 0.0;
  for (int i = 0; i < 20000; ++i) {  // 100 s: 1 m/s, a standstill, 3 m/s; poses with a centimetre of noise
    const double speed = i < 6000 ? 1.0 : i < 12000 ? 0.0 : 3.0;
    x += 0.005 * speed;
    FieldObservation one;
    one.position = {x + 0.01 * normal(generator), 0.01 * normal(generator), 0.0};
    one.time = from_seconds(0.005 * i);
    observations.push_back(one);
  }
  const HeldOutBlocks blocks(observations, 3.0, 5, 2);
  std::vector<double> first(60, 1e9), last(60, -1e9);
  for (const FieldObservation& one : observations) {
    const auto block = static_cast<std::size_t>(blocks.block_of(one.time));
    ASSERT_LT(block, first.size());
    first[block] = std::min(first[block], one.position.x());
    last[block] = std::max(last[block], one.position.x());
    EXPECT_EQ(blocks.contain(one), block % 5 == 2);
  }
  for (std::size_t block = 0; block < 40; ++block) EXPECT_NEAR(last[block] - first[block], 3.0, 0.8) << block;
  EXPECT_EQ(blocks.block_of(-5), 0);
}

}  // namespace
}  // namespace lodestone
