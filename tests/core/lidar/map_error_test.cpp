// Errors that points of a cube of the map share, by Monte Carlo.
#include "core/lidar/map_error.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace lodestone {
namespace {

constexpr double kNoise_m = 0.01;

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double normal(double sigma) { return sigma * normal_(generator_); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  Vector3 vector(double sigma) {
    const double x = normal(sigma);
    const double y = normal(sigma);
    return {x, y, normal(sigma)};
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

/// The map's displacement at a place: one vector for each cube of each scale.
class Displacement {
 public:
  Displacement(const MapErrorVariances& variances_m2, Random& random) : variances_m2_(variances_m2), random_(random) {}

  Vector3 at(const Vector3& place, int first_scale = 0) {
    Vector3 sum = Vector3::Zero();
    for (int s = first_scale; s < kMapErrorScales; ++s) {
      const auto [entry, is_new] = cubes_.try_emplace({s, map_error_cube(place, s)});
      if (is_new) entry->second = random_.vector(std::sqrt(variances_m2_[s]));
      sum += entry->second;
    }
    return sum;
  }

 private:
  MapErrorVariances variances_m2_;
  Random& random_;
  std::map<std::pair<int, MapErrorCube>, Vector3> cubes_;
};

struct Scan {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
};

/// A scan of a hall, in a displaced map.
Scan hall_scan(const Vector3& size_m, int points, const Pose& T_map_imu, Displacement& displacement, Random& random) {
  Scan scan;
  scan.planes.resize(static_cast<std::size_t>(points));
  for (int i = 0; i < points; ++i) {
    Vector3 place;
    for (int k = 0; k < 3; ++k) place[k] = random.uniform(0.1, size_m[k] - 0.1);
    const int axis = i % 3;
    place[axis] = i % 2 == 0 ? 0.02 : size_m[axis] - 0.02;
    Plane& plane = scan.planes[static_cast<std::size_t>(i)];
    const Vector3 normal = Vector3::Unit(axis);
    plane.normal = normal.cast<float>();
    plane.major = normal.unitOrthogonal().cast<float>();
    plane.center = place.cast<float>();
    // What stands at `place` less the displacement is shown at `place`.
    const Vector3 seen = place - displacement.at(place) + random.normal(kNoise_m) * normal;
    scan.matches.push_back({(T_map_imu.inverse() * seen).cast<float>(), &plane, static_cast<float>(kNoise_m * kNoise_m),
                            1.0F, 0.0F, static_cast<float>(kNoise_m * kNoise_m)});
  }
  return scan;
}

/// The pose that fits: error against `T_map_imu` as φ in map axes, p.
Vector6 fit(const Scan& scan, const Pose& T_map_imu, Pose& fitted) {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  for (const Correspondence& match : scan.matches) {
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = T_map_imu.rotation * match.point.cast<double>();
    Vector6 jacobian;
    jacobian << arm.cross(normal), normal;
    const double residual = normal.dot(arm + T_map_imu.position - match.plane->center.cast<double>());
    hessian += jacobian * jacobian.transpose();
    gradient += residual * jacobian;
  }
  const Vector6 step = -hessian.llt().solve(gradient);
  fitted = {so3::exp(step.head<3>()) * T_map_imu.rotation, T_map_imu.position + step.tail<3>()};
  return step;
}

const Vector3 kHall_m(24.0, 18.0, 6.0);

TEST(MapError, HasTheCovarianceOfThePoseAndIsFoundInTwoScans) {
  constexpr double kSigma_m = 0.02;
  constexpr int kDraws = 200;
  const MapErrorVariances variances_m2 = kSigma_m * kSigma_m * MapErrorVariances::Unit(0);
  Random random(7);
  const Pose first{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  const Pose second{so3::exp({-0.01, 0.02, 0.9}), {11.5, 8.5, 1.5}};
  double nees = 0.0;
  MapErrorMoments moments;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(variances_m2, random);
    const Scan scan = hall_scan(kHall_m, 1200, first, displacement, random);
    const Scan other = hall_scan(kHall_m, 1200, second, displacement, random);
    Pose fitted;
    Pose other_fitted;
    const Vector6 error = fit(scan, first, fitted);
    fit(other, second, other_fitted);
    const MapError here = analyse_map_error(scan.matches, fitted);
    const Matrix6 root = pose_error_root(here.pose_covariance_of(variances_m2));
    nees += root.triangularView<Eigen::Lower>().solve(error).squaredNorm() / 6.0 / kDraws;
    const auto found = compare_map_errors(here, analyse_map_error(other.matches, other_fitted));
    ASSERT_TRUE(found.has_value());
    moments.products_m2 += found->products_m2;
    moments.gains += found->gains;
  }
  EXPECT_NEAR(std::sqrt(moments.finest_variance_m2()) / kSigma_m, 1.0, 0.15);
  const MapErrorVariances repeated = moments.variances_m2();
  std::printf("NEES %.3f, repeated sigma %.4f m of %.4f m\n", nees, std::sqrt(repeated[0]), kSigma_m);
  // Noise of the points adds 1 cm over the root of some hundred points of a cube: a few percent.
  EXPECT_NEAR(nees, 1.0, 0.15);
  EXPECT_NEAR(std::sqrt(repeated[0]) / kSigma_m, 1.0, 0.15);
  EXPECT_LT(repeated.tail<3>().sum(), 0.2 * repeated[0]);
}

// A port of 150 m by 120 m that is displaced over tens of metres. The place is displaced on the two longest scales.
TEST(MapError, OfSeveralScalesIsFoundAndIsAgainstTheDisplacedPlace) {
  constexpr int kDraws = 150;
  const Vector3 port_m(150.0, 120.0, 14.0);
  MapErrorVariances variances_m2;
  variances_m2 << 0.0, 1e-4, 2e-4, 2e-4;
  Random random(9);
  const Pose first{so3::exp({0.02, -0.01, 0.7}), {73.0, 58.0, 1.5}};
  const Pose second{so3::exp({-0.01, 0.02, 0.9}), {75.0, 58.5, 1.5}};
  double nees = 0.0;
  double one_scale_nees = 0.0;
  MapErrorMoments moments;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(variances_m2, random);
    const Scan scan = hall_scan(port_m, 3000, first, displacement, random);
    const Scan other = hall_scan(port_m, 3000, second, displacement, random);
    Pose fitted;
    Pose other_fitted;
    Vector6 error = fit(scan, first, fitted);
    error.tail<3>() -= displacement.at(first.position, 2);
    fit(other, second, other_fitted);
    const MapError here = analyse_map_error(scan.matches, fitted);
    const auto against = [&](const Matrix6& root) {
      return root.triangularView<Eigen::Lower>().solve(error).squaredNorm() / 6.0 / kDraws;
    };
    nees += against(pose_error_root(here.pose_covariance_of(variances_m2)));
    one_scale_nees +=
        against(pose_error_root(here.pose_covariance_of(variances_m2.sum() * MapErrorVariances::Unit(0))));
    const auto found = compare_map_errors(here, analyse_map_error(other.matches, other_fitted));
    ASSERT_TRUE(found.has_value());
    moments.products_m2 += found->products_m2;
    moments.gains += found->gains;
  }
  const MapErrorVariances repeated = moments.variances_m2();
  std::printf("NEES %.3f (as cubes of 5 m: %.1f), variances %.2f %.2f %.2f %.2f cm2\n", nees, one_scale_nees,
              1e4 * repeated[0], 1e4 * repeated[1], 1e4 * repeated[2], 1e4 * repeated[3]);
  EXPECT_NEAR(nees, 1.0, 0.2);
  EXPECT_GT(one_scale_nees, 10.0);
  EXPECT_NEAR(repeated.sum(), variances_m2.sum(), 0.25 * variances_m2.sum());
  EXPECT_LT(repeated[0], 0.1 * variances_m2.sum());
  EXPECT_NEAR(repeated[1], variances_m2[1], 0.4e-4);
}

// A room within one cube of each of the long scales: the room's displacement moves the place with it.
TEST(MapError, OfAScaleAboveTheWholeScanIsNone) {
  Random random(12);
  Displacement none(MapErrorVariances::Zero(), random);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  const MapError error = analyse_map_error(hall_scan({16.0, 17.0, 6.0}, 1200, pose, none, random).matches, pose);
  for (int s = 2; s < kMapErrorScales; ++s) {
    EXPECT_LT(error.pose_covariance[s].norm(), 1e-6) << s;
    EXPECT_GT(error.fit_covariance[s].norm(), 0.1) << s;
  }
}

TEST(MapError, ChangesOverTheEdgeOfItsCubes) {
  Random random(10);
  Displacement none(MapErrorVariances::Zero(), random);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  const MapError error = analyse_map_error(hall_scan(kHall_m, 1200, pose, none, random).matches, pose);
  for (int s = 0; s < kMapErrorScales; ++s) {
    if (error.pose_covariance[s].bottomRightCorner<3, 3>().trace() < 1e-9) continue;
    EXPECT_DOUBLE_EQ(error.length_m_of(MapErrorVariances::Unit(s)), map_error_cube_m(s));
  }
  EXPECT_EQ(error.length_m_of(MapErrorVariances::Zero()), kMapErrorCube_m);
}

TEST(MapError, OfAMapThatRepeatsNothingIsNoneAndFewCubesSayNothing) {
  constexpr int kDraws = 100;
  Random random(8);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(MapErrorVariances::Zero(), random);
    const Scan scan = hall_scan(kHall_m, 1200, pose, displacement, random);
    const Scan other = hall_scan(kHall_m, 1200, pose, displacement, random);
    Pose fitted;
    Pose other_fitted;
    fit(scan, pose, fitted);
    fit(other, pose, other_fitted);
    const MapErrorMoments moments =
        *compare_map_errors(analyse_map_error(scan.matches, fitted), analyse_map_error(other.matches, other_fitted));
    const double found = moments.products_m2[0] / moments.gains(0, 0);
    sum += found;
    squares += found * found;
  }
  EXPECT_LT(std::abs(sum), 3.0 * std::sqrt(squares));  // the mean within three of its sigmas
  EXPECT_LT(squares / kDraws, std::pow(2e-3, 4));      // a pair of scans finds 2 mm of points with 1 cm of noise
  EXPECT_TRUE(analyse_map_error({}, pose).cubes.empty());
  EXPECT_FALSE(compare_map_errors({}, {}).has_value());
  EXPECT_GT(pose_error_root(MapError{}.pose_covariance_of(MapErrorVariances::Zero())).determinant(), 0.0);
}

// The planes of a floor at z = 0 lie a few millimetres under and over it. Parted by that, they would seem displaced.
TEST(MapError, HasNoFaceOfACubeAtARoundCoordinate) {
  for (int scale = 0; scale < kMapErrorScales; ++scale) {
    for (int metres = -100; metres <= 100; ++metres) {
      const Vector3 place = Vector3::Constant(metres);
      EXPECT_EQ(map_error_cube(place - Vector3::Constant(0.03), scale),
                map_error_cube(place + Vector3::Constant(0.03), scale))
          << metres << " m, scale " << scale;
    }
  }
}

// The pose that a window estimates errs alike in scans that follow each other. That must not seem to be the map's
// error.
TEST(MapError, IsOfTheScansOwnFitWhereverTheScanIsLookedAtFrom) {
  Random random(11);
  Displacement displacement(1e-4 * MapErrorVariances::Unit(0), random);
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
  moments.gains << 7.0, 6.0, 5.0, 2.0, 7.0, 18.0, 13.0, 6.0, 7.0, 17.0, 35.0, 14.0, 7.0, 17.0, 33.0, 40.0;
  const MapErrorVariances truth(1e-4, 0.0, 3e-4, 0.0);
  moments.products_m2 = moments.gains * truth;
  EXPECT_LT((moments.variances_m2() - truth).norm(), 0.05 * truth.norm());
  moments.products_m2[1] *= 0.5;
  EXPECT_GE(moments.variances_m2().minCoeff(), 0.0);
  moments.products_m2.setConstant(-1e-4);
  EXPECT_EQ(moments.variances_m2().sum(), 0.0);
}

}  // namespace
}  // namespace lodestone
