// The pose of a scan in a displaced map: Monte Carlo, and generalized least squares by brute force.
#include "core/lidar/bent_map.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/lidar/condensed_cost.h"
#include "core/lidar/least_squares_error.h"
#include "core/lidar/map_error_moments.h"
#include "tests/core/lidar/displaced_hall.h"

namespace lodestone {
namespace {

const Vector3 kPort_m(150.0, 120.0, 14.0);
const Pose kInHall{so3::exp({0.02, -0.01, 0.7}), {9.0, 8.0, 1.5}};
const Pose kInPort{so3::exp({0.02, -0.01, 0.7}), {73.0, 58.0, 1.5}};

Matrix6 to_map_axes(const Pose& pose) {
  Matrix6 result = Matrix6::Identity();
  result.topLeftCorner<3, 3>() = pose.rotation.toRotationMatrix();
  return result;
}

/// Error of the best pose: what the least squares of the straightened points gives, seen through the share.
Vector6 best_error(const BentMapFit& bent, const Pose& pose) {
  Pose fitted;
  const Vector6 seen = to_map_axes(pose).transpose() * fit(bent.straightened, pose, fitted);
  return to_map_axes(pose) * bent.seen_share.fullPivLu().solve(seen);
}

/// What the factor knows of the pose.
Matrix6 information_of(const BentMapFit& bent, const Pose& pose) {
  return bent.seen_share.transpose() * condense(bent.straightened, pose).hessian(pose) * bent.seen_share;
}

/// Of the best pose, by all that is known to be wrong.
Matrix6 covariance_of(const BentMapFit& bent, const Pose& pose, double cube_variance_m2) {
  const Matrix6 noise = to_map_axes(pose) * information_of(bent, pose).inverse() * to_map_axes(pose).transpose();
  return noise + cube_variance_m2 * bent.cube_covariance + bent.long_error.covariance;
}

double nees(const Vector6& error, const Matrix6& covariance) {
  return error.dot(covariance.ldlt().solve(error)) / 6.0;
}

/// The place's own motion with the map.
Vector6 place_motion(const Displacement& displacement, const Vector3& place) {
  Vector6 result;
  result << displacement.turn_at(place), displacement.smooth_at(place);
  return result;
}

/// Walls, a floor and some hundred pieces of 1 m between them, as in a warehouse: much is near, much is far.
Scan cluttered_scan(int points, const Pose& T_map_imu, Displacement& displacement, Random& random) {
  Scan scan = hall_scan(kPort_m, points / 4, T_map_imu, displacement, random);
  scan.planes.reserve(static_cast<std::size_t>(2 * points));
  for (Correspondence& match : scan.matches)
    match.plane = &scan.planes[static_cast<std::size_t>(&match - scan.matches.data())];
  while (static_cast<int>(scan.matches.size()) < points) {
    const int axis = static_cast<int>(random.uniform(0.0, 2.0));
    const Vector3 piece =
        T_map_imu.position + Vector3(random.normal(20.0), random.normal(20.0), random.uniform(-1.0, 3.0));
    Plane plane;
    const Vector3 normal = Vector3::Unit(axis);
    plane.normal = normal.cast<float>();
    plane.major = normal.unitOrthogonal().cast<float>();
    plane.center = piece.cast<float>();
    scan.planes.push_back(plane);
    const Vector3 seen = piece - displacement.at(piece) + random.normal(kNoise_m) * normal;
    scan.matches.push_back({(T_map_imu.inverse() * seen).cast<float>(), &scan.planes.back(),
                            static_cast<float>(kNoise_m * kNoise_m), 1.0F, 0.0F,
                            static_cast<float>(kNoise_m * kNoise_m)});
  }
  return scan;
}

TEST(BentMap, HasTheCovarianceOfThePose) {
  constexpr int kDraws = 200;
  constexpr double kSigma_m = 0.02;
  Random random(7);
  double mean = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(kSigma_m, random);
    const Scan scan = hall_scan(kHall_m, 1200, kInHall, displacement, random);
    const BentMapFit bent = fit_in_bent_map(scan.matches, kInHall, kSigma_m * kSigma_m * MapErrorVariances::Unit(0));
    mean += nees(best_error(bent, kInHall), covariance_of(bent, kInHall, kSigma_m * kSigma_m)) / kDraws;
  }
  std::printf("NEES %.3f\n", mean);
  EXPECT_NEAR(mean, 1.0, 0.15);
}

// A port that is bent over tens of metres: smooth parts with other lengths than the model's. The place is displaced and
// rotated with its surroundings. The variances are those that pairs of scans show.
TEST(BentMap, IsAgainstTheDisplacedPlace) {
  constexpr int kDraws = 60;
  constexpr double kSigma_m = 0.02;
  Random random(9);
  const Pose second{so3::exp({-0.01, 0.02, 0.9}), {75.0, 58.5, 1.5}};
  for (const double length_m : {20.0, 28.0}) {
    std::vector<Scan> scans;
    std::vector<Vector6> places;
    MapErrorMoments moments;
    for (int i = 0; i < kDraws; ++i) {
      Displacement displacement(0.0, random);
      displacement.add_smooth(kSigma_m, length_m);
      scans.push_back(hall_scan(kPort_m, 3000, kInPort, displacement, random));
      const Scan other = hall_scan(kPort_m, 3000, second, displacement, random);
      places.push_back(place_motion(displacement, kInPort.position));
      const auto found = compare_map_errors(analyse_map_error(scans.back().matches, kInPort),
                                            analyse_map_error(other.matches, second));
      ASSERT_TRUE(found.has_value());
      moments.approach(*found, 1.0 / (i + 1));
    }
    const MapErrorVariances variances_m2 = moments.variances_m2();
    double mean = 0.0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const BentMapFit bent = fit_in_bent_map(scans[i].matches, kInPort, variances_m2);
      mean += nees(best_error(bent, kInPort) - places[i], covariance_of(bent, kInPort, variances_m2[0])) / kDraws;
    }
    std::printf("l %.0f m: NEES %.3f, sigmas %.1f %.1f %.1f %.1f mm\n", length_m, mean,
                1e3 * std::sqrt(variances_m2[0]), 1e3 * std::sqrt(variances_m2[1]), 1e3 * std::sqrt(variances_m2[2]),
                1e3 * std::sqrt(variances_m2[3]));
    EXPECT_NEAR(mean, 1.0, 0.25);
  }
}

/// Generalized least squares with the displacement at each point, instead of regions: relative to the place's motion S.
Vector6 by_brute_force(const Scan& scan, const Pose& pose, double variance_m2, int part) {
  const auto count = static_cast<Eigen::Index>(scan.matches.size());
  const double length_m = map_error_length_m(part);
  Eigen::MatrixXd jacobian(count, 6);
  Eigen::MatrixXd with_place(count, 6);
  Eigen::VectorXd residual(count);
  Vector6 of_place;
  of_place << Vector3::Constant(0.5 / (length_m * length_m)), Vector3::Ones();
  for (Eigen::Index i = 0; i < count; ++i) {
    const Correspondence& match = scan.matches[static_cast<std::size_t>(i)];
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 center = match.plane->center.cast<double>();
    const Vector3 arm = pose.rotation * match.point.cast<double>();
    residual[i] = normal.dot(arm + pose.position - center);
    jacobian.row(i) << arm.cross(normal).transpose(), normal.transpose();
    const double correlation = map_error_correlation((center - pose.position).squaredNorm(), part);
    with_place.row(i) = correlation * (jacobian.row(i) * of_place.asDiagonal());
  }
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const Plane& a = *scan.matches[static_cast<std::size_t>(i)].plane;
      const Plane& b = *scan.matches[static_cast<std::size_t>(j)].plane;
      covariance(i, j) = map_error_correlation((a.center - b.center).cast<double>().squaredNorm(), part) *
                         static_cast<double>(a.normal.dot(b.normal));
    }
  }
  covariance -= with_place * jacobian.transpose() + jacobian * with_place.transpose();
  covariance += jacobian * of_place.asDiagonal() * jacobian.transpose();
  covariance *= variance_m2;
  covariance.diagonal().array() += kNoise_m * kNoise_m;
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  const Eigen::MatrixXd weighed = factor.solve(jacobian);
  return -(jacobian.transpose() * weighed).ldlt().solve(weighed.transpose() * residual);
}

TEST(BentMap, IsNearlyAsExactAsDisplacementsOfSinglePoints) {
  constexpr int kDraws = 40;
  constexpr double kSigma_m = 0.02;
  constexpr int kPart = 2;
  Random random(13);
  double least_squares_m2 = 0.0;
  double bent_m2 = 0.0;
  double oracle_m2 = 0.0;
  double mean = 0.0;
  double plain_mean = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(0.0, random);
    displacement.add_smooth(kSigma_m, map_error_length_m(kPart));
    const Scan scan = cluttered_scan(800, kInPort, displacement, random);
    const Vector6 place = place_motion(displacement, kInPort.position);
    const MapErrorVariances variances_m2 = kSigma_m * kSigma_m * MapErrorVariances::Unit(kPart);
    Pose fitted;
    const BentMapFit bent = fit_in_bent_map(scan.matches, kInPort, variances_m2);
    const Vector6 error = best_error(bent, kInPort) - place;
    const Vector6 plain_error = fit(scan.matches, kInPort, fitted) - place;
    plain_mean += nees(plain_error, long_error_of(analyse_map_error(scan.matches, kInPort), variances_m2).covariance +
                                        1e-10 * Matrix6::Identity()) /
                  kDraws;
    least_squares_m2 += plain_error.tail<3>().squaredNorm() / kDraws;
    bent_m2 += error.tail<3>().squaredNorm() / kDraws;
    oracle_m2 += (by_brute_force(scan, kInPort, kSigma_m * kSigma_m, kPart) - place).tail<3>().squaredNorm() / kDraws;
    mean += nees(error, covariance_of(bent, kInPort, 0.0)) / kDraws;
  }
  std::printf("least squares %.1f mm, bent map %.1f mm, brute force %.1f mm, NEES %.2f (least squares %.2f)\n",
              1e3 * std::sqrt(least_squares_m2), 1e3 * std::sqrt(bent_m2), 1e3 * std::sqrt(oracle_m2), mean,
              plain_mean);
  EXPECT_LT(bent_m2, 0.35 * least_squares_m2);
  EXPECT_LT(bent_m2, 1.5 * oracle_m2);
  EXPECT_NEAR(mean, 1.0, 0.25);
  EXPECT_NEAR(plain_mean, 1.0, 0.25);
}

// Pallets near the robot were moved by 6 cm since the survey.
TEST(BentMap, WhatWasMovedNearbyCountsLittle) {
  constexpr int kDraws = 40;
  constexpr double kSigma_m = 0.01;
  constexpr int kPart = 2;
  const MapErrorVariances variances_m2 = kSigma_m * kSigma_m * MapErrorVariances::Unit(kPart);
  Random random(16);
  double straight_m2 = 0.0, moved_m2 = 0.0, mean = 0.0, unmoved_mean = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(0.0, random);
    displacement.add_smooth(kSigma_m, map_error_length_m(kPart));
    Scan scan = cluttered_scan(800, kInPort, displacement, random);
    const Vector6 place = place_motion(displacement, kInPort.position);
    const auto error = [&](double& sum_m2, double& nees_mean) {
      const BentMapFit bent = fit_in_bent_map(scan.matches, kInPort, variances_m2);
      const Vector6 found = best_error(bent, kInPort) - place;
      sum_m2 += found.tail<3>().squaredNorm() / kDraws;
      nees_mean += nees(found, covariance_of(bent, kInPort, 0.0)) / kDraws;
    };
    error(straight_m2, unmoved_mean);
    const Vector3 by_m(0.06, 0.0, 0.0);
    for (Correspondence& match : scan.matches) {
      const Vector3 arm = kInPort.rotation * match.point.cast<double>();
      if (arm.norm() > 12.0 || arm.x() < 0.0 || arm.y() < 0.0 || match.plane->normal.z() != 0.0F) continue;
      match.point += (kInPort.rotation.conjugate() * by_m).cast<float>();
    }
    error(moved_m2, mean);
  }
  std::printf("unmoved %.1f mm, NEES %.2f; moved %.1f mm, NEES %.2f\n", 1e3 * std::sqrt(straight_m2), unmoved_mean,
              1e3 * std::sqrt(moved_m2), mean);
  EXPECT_LT(moved_m2, 1.6 * straight_m2);  // 3.5 if they counted
  EXPECT_NEAR(unmoved_mean, 1.0, 0.25);
  EXPECT_LT(mean, 2.5);  // 10.9
}

// A displacement that is the same everywhere displaces the place with it, and is no error.
TEST(BentMap, MovesWithItsSurroundings) {
  Random random(12);
  Displacement none(0.0, random);
  const Pose pose{so3::exp({0.02, -0.01, 0.7}), {4.0, 3.0, 1.5}};
  const Scan scan = hall_scan({8.0, 7.0, 4.0}, 1200, pose, none, random);
  const BentMapFit bent = fit_in_bent_map(scan.matches, pose, MapErrorVariances::Unit(3));
  EXPECT_LT(bent.long_error.covariance.diagonal().tail<3>().maxCoeff(), 0.05 * 0.05);
  EXPECT_LT(bent.long_error.covariance(2, 2), 0.15 * 0.5 / (40.0 * 40.0));
  EXPECT_DOUBLE_EQ(bent.long_error.length_m, 40.0);
}

TEST(BentMap, OfAMapThatIsNotDisplacedIsTheLeastSquares) {
  Random random(14);
  Displacement none(0.0, random);
  Scan scan = hall_scan(kHall_m, 1200, kInHall, none, random);
  for (Plane& plane : scan.planes) plane.major_tilt_variance = 1e-3F;
  const BentMapFit bent = fit_in_bent_map(scan.matches, kInHall, MapErrorVariances::Zero());
  const CondensedCost cost = condense(scan.matches, kInHall);
  for (std::size_t i = 0; i < scan.matches.size(); ++i) {
    EXPECT_LT((bent.straightened[i].point - scan.matches[i].point).norm(), 1e-5) << i;
  }
  EXPECT_LT((bent.seen_share - cost.seen_share(kInHall)).norm(), 1e-3);
  EXPECT_EQ(bent.long_error.covariance.norm(), 0.0);
  EXPECT_TRUE(fit_in_bent_map({}, kInHall, MapErrorVariances::Ones()).straightened.empty());
}

// A corridor whose ends alone show the place along it. Normals of the walls beside the robot err by a tenth more than
// is stated, so that some of what they pretend remains. Yet they do not outweigh the ends, which are displaced by
// centimetres.
TEST(BentMap, NormalsNearbyDoNotOutweighTheEndsOfACorridor) {
  constexpr int kDraws = 100;
  constexpr double kSigma_m = 0.05;
  constexpr double kTilt = 0.07;
  constexpr int kPart = 2;
  const Vector3 corridor_m(62.0, 2.5, 3.0);
  const Pose pose{so3::exp({0.0, 0.0, 0.05}), {16.0, 1.2, 1.0}};
  const MapErrorVariances variances_m2 = kSigma_m * kSigma_m * MapErrorVariances::Unit(kPart);
  Random random(17);
  double along_m2 = 0.0, along_nees = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Displacement displacement(0.0, random);
    displacement.add_smooth(kSigma_m, map_error_length_m(kPart));
    Scan scan = hall_scan(corridor_m, 3000, pose, displacement, random);
    std::vector<Correspondence> seen;
    for (std::size_t k = 0; k < scan.matches.size(); ++k) {
      Plane& plane = scan.planes[k];
      const bool is_end = plane.normal.x() != 0.0F;
      if (is_end && k % 10 != 0) continue;  // far away, few beams
      seen.push_back(scan.matches[k]);
      if (is_end) continue;
      plane.normal = (plane.normal + static_cast<float>(random.normal(1.1 * kTilt)) * Eigen::Vector3f::UnitX());
      plane.normal.normalize();
      plane.major = Eigen::Vector3f::UnitX();
      plane.major_tilt_variance = static_cast<float>(kTilt * kTilt);
    }
    const BentMapFit bent = fit_in_bent_map(seen, pose, variances_m2);
    const Vector6 error = best_error(bent, pose) - place_motion(displacement, pose.position);
    along_m2 += error[3] * error[3] / kDraws;
    along_nees += error[3] * error[3] / covariance_of(bent, pose, 0.0)(3, 3) / kDraws;
  }
  std::printf("along the corridor %.1f mm, NEES %.2f\n", 1e3 * std::sqrt(along_m2), along_nees);
  EXPECT_LT(along_m2, kSigma_m * kSigma_m);  // 242 mm if they did
  EXPECT_NEAR(along_nees, 1.0, 0.25);        // 79
}

// Along a direction that only errors of normals seem to show, the scan observes nothing.
TEST(BentMap, DoesNotSeeWhatNormalsPretend) {
  Random random(15);
  Displacement none(0.0, random);
  Scan scan = hall_scan({200.0, 4.0, 3.0}, 3000, {so3::exp({0.0, 0.0, 0.1}), {90.0, 2.0, 1.0}}, none, random);
  const Pose pose{so3::exp({0.0, 0.0, 0.1}), {90.0, 2.0, 1.0}};
  std::vector<Correspondence> walls;
  for (const Correspondence& match : scan.matches) {
    if (match.plane->normal.x() == 0.0F) walls.push_back(match);
  }
  for (Plane& plane : scan.planes) {
    const float tilt = static_cast<float>(random.normal(0.02));
    plane.normal = (plane.normal + tilt * Eigen::Vector3f::UnitX()).normalized();
    plane.major = Eigen::Vector3f::UnitX();
    plane.major_tilt_variance = 0.02F * 0.02F;
  }
  const BentMapFit bent = fit_in_bent_map(walls, pose, MapErrorVariances::Constant(1e-4));
  const double pretended = condense(walls, pose).spurious_information(3, 3);
  const Matrix6 seen = information_of(bent, pose);
  std::printf("pretended %.0f, seen %.1f of 1/m2\n", pretended, seen(3, 3));
  EXPECT_GT(pretended, 1e3);
  EXPECT_LT(seen(3, 3), 0.02 * pretended);
  EXPECT_GT(seen(4, 4), 1e4);
}

}  // namespace
}  // namespace lodestone
