// Errors that points of a cube of the map share, by Monte Carlo.
#include "core/lidar/map_error.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
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

/// The map's displacement at a place: one for each cube.
class Displacement {
 public:
  Displacement(double sigma_m, Random& random) : sigma_m_(sigma_m), random_(random) {}

  const Vector3& at(const Vector3& place) {
    const std::array<int, 3> cube{static_cast<int>(std::floor(place.x() / kMapErrorCube_m)),
                                  static_cast<int>(std::floor(place.y() / kMapErrorCube_m)),
                                  static_cast<int>(std::floor(place.z() / kMapErrorCube_m))};
    const auto [entry, is_new] = cubes_.try_emplace(cube);
    if (is_new) entry->second = random_.vector(sigma_m_);
    return entry->second;
  }

 private:
  double sigma_m_;
  Random& random_;
  std::map<std::array<int, 3>, Vector3> cubes_;
};

struct Scan {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
};

/// A scan of a hall of 24 m by 18 m by 6 m, in a displaced map.
Scan hall_scan(const Pose& T_map_imu, Displacement& displacement, Random& random) {
  constexpr int kPoints = 1200;
  Scan scan;
  scan.planes.resize(kPoints);
  for (int i = 0; i < kPoints; ++i) {
    Vector3 place(random.uniform(0.1, 23.9), random.uniform(0.1, 17.9), random.uniform(0.1, 5.9));
    const int axis = i % 3;
    const double far[] = {24.0, 18.0, 6.0};
    place[axis] = i % 2 == 0 ? 0.02 : far[axis] - 0.02;
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

TEST(MapError, TellsHowFarTheCubesMoveAPoseAndWhatTheyRepeat) {
  constexpr double kSigma_m = 0.02;
  constexpr int kDraws = 200;
  Random random(7);
  const Pose first{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  const Pose second{so3::exp({-0.01, 0.02, 0.9}), {11.5, 8.5, 1.5}};
  double nees = 0.0;
  MapErrorMoments moments;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(kSigma_m, random);
    const Scan scan = hall_scan(first, displacement, random);
    const Scan other = hall_scan(second, displacement, random);
    Pose fitted;
    Pose other_fitted;
    const Vector6 error = fit(scan, first, fitted);
    fit(other, second, other_fitted);
    const MapError here = analyse_map_error(scan.matches, fitted);
    const Matrix6 root = here.pose_error_root_of(kSigma_m * kSigma_m);
    nees += root.triangularView<Eigen::Lower>().solve(error).squaredNorm() / 6.0 / kDraws;
    const auto found = compare_map_errors(here, analyse_map_error(other.matches, other_fitted));
    ASSERT_TRUE(found.has_value());
    moments.product_m2 += found->product_m2;
    moments.gain += found->gain;
  }
  const double repeated = moments.variance_m2();
  std::printf("NEES %.3f, repeated sigma %.4f m of %.4f m\n", nees, std::sqrt(repeated), kSigma_m);
  // Noise of the points adds 1 cm over the root of some hundred points of a cube: a few percent.
  EXPECT_NEAR(nees, 1.0, 0.15);
  EXPECT_NEAR(std::sqrt(repeated) / kSigma_m, 1.0, 0.15);
}

TEST(MapError, OfAMapThatRepeatsNothingIsNoneAndFewCubesSayNothing) {
  constexpr int kDraws = 100;
  Random random(8);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(0.0, random);
    const Scan scan = hall_scan(pose, displacement, random);
    const Scan other = hall_scan(pose, displacement, random);
    Pose fitted;
    Pose other_fitted;
    fit(scan, pose, fitted);
    fit(other, pose, other_fitted);
    const MapErrorMoments moments =
        *compare_map_errors(analyse_map_error(scan.matches, fitted), analyse_map_error(other.matches, other_fitted));
    const double found = moments.product_m2 / moments.gain;
    EXPECT_EQ(moments.variance_m2(), std::max(0.0, found));
    sum += found;
    squares += found * found;
  }
  EXPECT_LT(std::abs(sum), 3.0 * std::sqrt(squares));  // the mean within three of its sigmas
  EXPECT_LT(squares / kDraws, std::pow(2e-3, 4));      // a pair of scans finds 2 mm of points with 1 cm of noise
  EXPECT_TRUE(analyse_map_error({}, pose).cubes.empty());
  EXPECT_FALSE(compare_map_errors({}, {}).has_value());
  EXPECT_GT(MapError{}.pose_error_root_of(0.0).determinant(), 0.0);
}

}  // namespace
}  // namespace lodestone
