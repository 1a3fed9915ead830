// Errors that places of the map share: Monte Carlo.
#include "core/lidar/map_error.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/lidar/least_squares_error.h"
#include "core/lidar/map_error_moments.h"
#include "tests/core/lidar/displaced_hall.h"

namespace lodestone {
namespace {

TEST(MapError, HasTheCovarianceOfThePoseAndIsFoundInTwoScans) {
  constexpr double kSigma_m = 0.02;
  constexpr int kDraws = 200;
  Random random(7);
  const Pose first{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  const Pose second{so3::exp({-0.01, 0.02, 0.9}), {11.5, 8.5, 1.5}};
  double nees = 0.0;
  MapErrorMoments moments;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(kSigma_m, random);
    const Scan scan = hall_scan(kHall_m, 1200, first, displacement, random);
    const Scan other = hall_scan(kHall_m, 1200, second, displacement, random);
    Pose fitted;
    Pose other_fitted;
    const Vector6 error = fit(scan.matches, first, fitted);
    fit(other.matches, second, other_fitted);
    const MapError here = analyse_map_error(scan.matches, fitted);
    const Matrix6 root = pose_error_root(kSigma_m * kSigma_m * cube_covariance_of(here));
    nees += root.triangularView<Eigen::Lower>().solve(error).squaredNorm() / 6.0 / kDraws;
    const auto found = compare_map_errors(here, analyse_map_error(other.matches, other_fitted));
    ASSERT_TRUE(found.has_value());
    moments.approach(*found, 1.0 / (i + 1));
  }
  EXPECT_NEAR(std::sqrt(moments.cube_variance_m2()) / kSigma_m, 1.0, 0.15);
  const MapErrorVariances repeated = moments.variances_m2();
  std::printf("NEES %.3f, repeated sigma %.4f m of %.4f m\n", nees, std::sqrt(repeated[0]), kSigma_m);
  // Noise of the points adds 1 cm over the root of a cube's number of points, some hundred: a few percent.
  EXPECT_NEAR(nees, 1.0, 0.15);
  EXPECT_NEAR(std::sqrt(repeated[0]) / kSigma_m, 1.0, 0.15);
  EXPECT_LT(repeated.tail<3>().sum(), 0.2 * repeated[0]);
}

// A port of 150 m by 120 m that is bent over tens of metres: smooth parts with other lengths than the model's. The
// place is displaced and rotated with its surroundings.
TEST(MapError, OfABentMapIsFoundAndIsAgainstTheDisplacedPlace) {
  constexpr int kDraws = 150;
  constexpr double kSigma_m = 0.02;
  const Vector3 port_m(150.0, 120.0, 14.0);
  Random random(9);
  const Pose first{so3::exp({0.02, -0.01, 0.7}), {73.0, 58.0, 1.5}};
  const Pose second{so3::exp({-0.01, 0.02, 0.9}), {75.0, 58.5, 1.5}};
  for (const double length_m : {20.0, 28.0}) {
    std::vector<Vector6> errors;
    std::vector<MapError> scans;
    MapErrorMoments moments;
    for (int i = 0; i < kDraws; ++i) {
      Displacement displacement(0.0, random);
      displacement.add_smooth(kSigma_m, length_m);
      const Scan scan = hall_scan(port_m, 3000, first, displacement, random);
      const Scan other = hall_scan(port_m, 3000, second, displacement, random);
      Pose fitted;
      Pose other_fitted;
      errors.push_back(fit(scan.matches, first, fitted));
      errors.back().head<3>() -= displacement.turn_at(first.position);
      errors.back().tail<3>() -= displacement.at(first.position);
      fit(other.matches, second, other_fitted);
      scans.push_back(analyse_map_error(scan.matches, fitted));
      const auto found = compare_map_errors(scans.back(), analyse_map_error(other.matches, other_fitted));
      ASSERT_TRUE(found.has_value());
      moments.approach(*found, 1.0 / (i + 1));
    }
    const MapErrorVariances variances_m2 = moments.variances_m2();
    double nees = 0.0;
    double cubes_nees = 0.0;
    for (int i = 0; i < kDraws; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto against = [&](const Matrix6& covariance) {
        return pose_error_root(covariance).triangularView<Eigen::Lower>().solve(errors[k]).squaredNorm() / 6.0 / kDraws;
      };
      nees += against(long_error_of(scans[k], variances_m2).covariance);
      cubes_nees += against(moments.cube_variance_m2() * cube_covariance_of(scans[k]));
    }
    std::printf("l %.0f m: NEES %.3f (as cubes of 5 m: %.1f), sigmas %.1f %.1f %.1f %.1f mm\n", length_m, nees,
                cubes_nees, 1e3 * std::sqrt(variances_m2[0]), 1e3 * std::sqrt(variances_m2[1]),
                1e3 * std::sqrt(variances_m2[2]), 1e3 * std::sqrt(variances_m2[3]));
    EXPECT_NEAR(nees, 1.0, 0.25);
    EXPECT_GT(cubes_nees, 10.0);
  }
}

// An error that displaces and rotates the whole scan moves the place as well. Roll and pitch follow the floor's slope,
// which is not half of the curl.
TEST(MapError, OverFarLongerThanTheScanIsNone) {
  Random random(12);
  Displacement none(0.0, random);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {4.0, 3.0, 1.5}};
  const MapError error = analyse_map_error(hall_scan({8.0, 7.0, 4.0}, 1200, pose, none, random).matches, pose);
  const LongMapError found = long_error_of(error, MapErrorVariances::Unit(3));
  EXPECT_LT(found.covariance.diagonal().tail<3>().maxCoeff(), 0.05 * 0.05);
  EXPECT_LT(found.covariance(2, 2), 0.1 * 0.5 / (40.0 * 40.0));
  EXPECT_DOUBLE_EQ(found.length_m, 40.0);
  EXPECT_EQ(long_error_of(error, MapErrorVariances::Unit(0)).covariance.norm(), 0.0);
}

// The mean square of white offsets of n cells has 3 n independent values; that of a displacement that is nearly the
// same everywhere has few.
TEST(MapError, CountsItsIndependentValues) {
  Random random(10);
  Displacement none(0.0, random);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {73.0, 58.0, 1.5}};
  const MapError error = analyse_map_error(hall_scan({150.0, 120.0, 14.0}, 3000, pose, none, random).matches, pose);
  constexpr int kDraws = 1000;
  for (int part = 1; part < kMapErrorParts; ++part) {
    double sum = 0.0;
    double squares = 0.0;
    for (int i = 0; i < kDraws; ++i) {
      Displacement displacement(0.0, random);
      displacement.add_smooth(1.0, map_error_length_m(part));
      Vector6 taken = Vector6::Zero();
      for (const PlaceOffset& cell : error.cells) taken += cell.coupling * displacement.at(cell.center);
      taken = error.inverse * taken;
      double square = 0.0;
      for (const PlaceOffset& cell : error.cells) {
        square += (cell.gain * displacement.at(cell.center) - cell.by_pose.transpose() * taken).squaredNorm();
      }
      sum += square / kDraws;
      squares += square * square / kDraws;
    }
    // A mean square of n values has n = 2 mean² / variance.
    const double values = 2.0 * sum * sum / (squares - sum * sum);
    std::printf("part %d: %.1f values of %zu cells\n", part, values, error.cells.size());
    EXPECT_NEAR(degrees_of_freedom(error, MapErrorVariances::Unit(part)) / values, 1.0, 0.25) << part;
  }
  EXPECT_EQ(degrees_of_freedom(error, MapErrorVariances::Zero()), 0.0);
  EXPECT_EQ(degrees_of_freedom({}, MapErrorVariances::Ones()), 0.0);
}

TEST(MapError, OfAMapThatRepeatsNothingIsNoneAndFewCubesSayNothing) {
  constexpr int kDraws = 100;
  Random random(8);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(0.0, random);
    const Scan scan = hall_scan(kHall_m, 1200, pose, displacement, random);
    const Scan other = hall_scan(kHall_m, 1200, pose, displacement, random);
    Pose fitted;
    Pose other_fitted;
    fit(scan.matches, pose, fitted);
    fit(other.matches, pose, other_fitted);
    const MapErrorMoments moments =
        *compare_map_errors(analyse_map_error(scan.matches, fitted), analyse_map_error(other.matches, other_fitted));
    const double found = moments.products_m2[0] / moments.gains(0, 0);
    sum += found;
    squares += found * found;
  }
  EXPECT_LT(std::abs(sum), 3.0 * std::sqrt(squares));  // the mean within three of its sigmas
  EXPECT_LT(squares / kDraws, std::pow(2e-3, 4));      // one pair of scans detects 2 mm, with points of 1 cm of noise
  EXPECT_TRUE(analyse_map_error({}, pose).cubes.empty());
  EXPECT_FALSE(compare_map_errors({}, {}).has_value());
  EXPECT_GT(pose_error_root(long_error_of({}, MapErrorVariances::Ones()).covariance).determinant(), 0.0);
}

// The planes of a floor at z = 0 lie a few millimetres below and above it. Divided between cubes, they would seem
// displaced.
TEST(MapError, HasNoFaceOfACubeAtARoundCoordinate) {
  for (int metres = -100; metres <= 100; ++metres) {
    const Vector3 place = Vector3::Constant(metres);
    EXPECT_EQ(map_error_cube(place - Vector3::Constant(0.03)), map_error_cube(place + Vector3::Constant(0.03)))
        << metres;
  }
}

// Consecutive scans share the error of the window's pose estimate. This must not count as an error of the map.
TEST(MapError, IsOfTheScansOwnFitWhereverTheScanIsLookedAtFrom) {
  Random random(11);
  Displacement displacement(0.01, random);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  const Scan scan = hall_scan(kHall_m, 1200, pose, displacement, random);
  const Pose beside{so3::exp({1e-4, -2e-4, 1e-4}) * pose.rotation, pose.position + Vector3(0.004, -0.003, 0.002)};
  const MapError here = analyse_map_error(scan.matches, pose);
  const MapError there = analyse_map_error(scan.matches, beside);
  ASSERT_EQ(here.cubes.size(), there.cubes.size());
  for (std::size_t i = 0; i < here.cubes.size(); ++i) {
    EXPECT_LT((here.cubes[i].offset_m - there.cubes[i].offset_m).norm(), 1e-5) << i;
  }
}

TEST(MapError, VariancesFitTheMomentsBestAndAreNeverNegative) {
  MapErrorMoments moments;
  moments.gains << 52.0, 31.0, 17.0, 7.0, 50.0, 111.0, 56.0, 23.0, -9.0, 131.0, 133.0, 61.0, 15.0, -6.0, 71.0, 60.0,
      7.0, 35.0, -6.0, -6.0, 1.0, 17.0, 32.0, 8.0;
  moments.scatter << 35.0, 5e3, 2e4, 1.5e4, 1.8e4, 1.5e3;
  const MapErrorVariances truth(1e-4, 0.0, 3e-4, 0.0);
  moments.products_m2 = moments.gains * truth;
  EXPECT_LT((moments.gains * moments.variances_m2() - moments.products_m2).norm(), 0.05 * moments.products_m2.norm());
  EXPECT_NEAR(moments.variances_m2().sum(), truth.sum(), 0.1 * truth.sum());
  moments.products_m2[1] *= 0.5;
  EXPECT_GE(moments.variances_m2().minCoeff(), 0.0);
  moments.products_m2.setConstant(-1e-4);
  EXPECT_GE(moments.variances_m2().minCoeff(), 0.0);
  EXPECT_LT(moments.variances_m2().sum(), 1e-5);
}

}  // namespace
}  // namespace lodestone
