// Errors of deskewing, and the noise of the IMU within a scan, against brute force.
#include "core/lidar/swept_cost.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "core/imu/hermite.h"
#include "core/lidar/square_root.h"

namespace lodestone {
namespace {

constexpr double kStepS = 0.1;
constexpr int kSamples = 20;

class RandomVectors {
 public:
  explicit RandomVectors(std::uint64_t seed) : generator_(seed) {}
  Vector3 vector(double scale = 1.0) {
    const double x = normal_(generator_);
    const double y = normal_(generator_);
    return scale * Vector3(x, y, normal_(generator_));
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

std::vector<ImuSample> imu_samples(const Vector3& rate_error) {
  std::vector<ImuSample> samples;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = kStepS * i / kSamples;
    samples.push_back({from_seconds(t), Vector3(0.3, -0.2 + 2.0 * t, 0.5) + rate_error, Vector3(0.4, 1.0, 9.8)});
  }
  return samples;
}

NavState end_state() {
  NavState state;
  state.T_map_imu = {so3::exp({0.3, -0.4, 1.2}), {4.0, -2.0, 1.0}};
  state.velocity = {1.0, 0.4, -0.1};
  state.gravity = {0.0, 0.0, -9.80665};
  return state;
}

TEST(Deskewing, TheStatesDepartureBringsPointsBackThatAWrongImuAndVelocityDisplaced) {
  const NavState truth = end_state();
  const ScanMotion true_motion(truth, imu_samples(Vector3::Zero()));
  NavState guess = truth;
  guess.velocity += Vector3(0.02, -0.01, 0.03);
  const ScanMotion guessed_motion(guess, imu_samples({0.01, -0.02, 0.015}));
  const Deskewing deskewing(guess, guessed_motion, ImuNoise{});
  NavState before = truth;
  before.T_map_imu = true_motion.pose(0);
  before.velocity = truth.T_map_imu.rotation * true_motion.relative_begin_velocity();
  const Vector12 departure = deskewing.departure(&before, truth, nullptr);
  const ScanMotion pinned(before, truth, imu_samples({0.01, -0.02, 0.015}));
  for (const double age_s : {0.0, 0.03, 0.07, 0.1}) {
    const Time time = from_seconds(kStepS - age_s);
    const Vector3 point(8.0, -5.0, 2.0);
    const Vector3 place = true_motion.pose(time) * point;
    const Pose T_end_t = guessed_motion.relative_pose(time);
    const Vector3 untouched = truth.T_map_imu * (T_end_t * point);
    const Hermite basis(age_s, kStepS);
    const Vector3 corrected =
        truth.T_map_imu *
            (so3::exp(basis.share * departure.head<3>()) * (T_end_t.rotation * point) + T_end_t.position) +
        basis.near_slope * departure.segment<3>(3) + basis.far_position * departure.segment<3>(6) +
        basis.far_slope * departure.tail<3>();
    // A rotating platform distributes the error unevenly, which is of second order.
    EXPECT_LT((corrected - place).norm(), 0.05 * (untouched - place).norm() + 1e-9) << age_s;
    // The motion between both states contains this correction.
    EXPECT_LT((pinned.pose(time) * point - place).norm(), 0.05 * (untouched - place).norm() + 1e-9) << age_s;
  }
  // If the state before is unknown, the motion of the IMU is used.
  NavState guessed = truth;
  guessed.velocity = truth.T_map_imu.rotation * guess.T_map_imu.rotation.conjugate() * guess.velocity;
  EXPECT_TRUE(deskewing.departure(nullptr, guessed, nullptr).isZero(1e-12));
}

TEST(Deskewing, AMotionBetweenTwoStatesHasThemAtItsEnds) {
  RandomVectors random(5);
  const NavState end = end_state();
  const ScanMotion motion(end, imu_samples(Vector3::Zero()));
  NavState before = end;
  before.T_map_imu = motion.pose(0);
  before.T_map_imu.rotation = before.T_map_imu.rotation * so3::exp(random.vector(0.05));
  before.T_map_imu.position += random.vector(0.1);
  before.velocity += random.vector(0.3);
  const ScanMotion pinned(before, end, imu_samples(Vector3::Zero()));
  EXPECT_LT(pinned.pose(0).boxminus(before.T_map_imu).norm(), 1e-9);
  EXPECT_LT(pinned.pose(from_seconds(kStepS)).boxminus(end.T_map_imu).norm(), 1e-9);
  const Deskewing deskewing(end, pinned, ImuNoise{});
  EXPECT_LT(deskewing.departure(&before, end, nullptr).norm(), 1e-9);
  // Its slope at the beginning is the velocity of the state there.
  const double small_s = 1e-5;
  const Vector3 velocity = (pinned.pose(from_seconds(small_s)).position - pinned.pose(0).position) / small_s;
  EXPECT_LT((velocity - before.velocity).norm(), 1e-3);
}

TEST(Deskewing, AMapTurnedWithAllThatMovesInItChangesNothing) {
  RandomVectors random(12);
  Deskewing deskewing;
  deskewing.turn = so3::exp(random.vector(0.1));
  deskewing.velocity = random.vector();
  deskewing.before_position = random.vector(0.1);
  deskewing.before_velocity = random.vector();
  deskewing.step_s = kStepS;
  NavState before;
  before.T_map_imu = {so3::exp(random.vector()), random.vector()};
  before.velocity = random.vector();
  NavState end;
  end.T_map_imu = {before.T_map_imu.rotation * so3::exp(random.vector(0.1)), random.vector()};
  end.velocity = random.vector();
  const Pose move{so3::exp(random.vector()), random.vector()};
  const auto moved = [&](NavState state) {
    state.T_map_imu = move * state.T_map_imu;
    state.velocity = move.rotation * state.velocity;
    return state;
  };
  const NavState moved_before = moved(before);
  const Vector12 departure = deskewing.departure(&before, end, nullptr);
  EXPECT_GT(departure.norm(), 1e-3);
  const Vector12 turned = deskewing.departure(&moved_before, moved(end), nullptr);
  EXPECT_LT((turned.head<3>() - departure.head<3>()).norm(), 1e-12);
  for (int group = 1; group < 4; ++group) {
    EXPECT_LT((turned.segment<3>(3 * group) - move.rotation * Vector3(departure.segment<3>(3 * group))).norm(), 1e-12);
  }
}

struct Points {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
  Pose pose;
  Eigen::MatrixXd pose_jacobian;  // one row per point: φ, p
  Eigen::MatrixXd turning;        // p × Rᵀn
  Eigen::MatrixXd normals;
  Eigen::VectorXd ages_s;
};

Points points_round_the_robot(std::uint64_t seed, int count, double variance_m2 = 1e-4) {
  RandomVectors random(seed);
  Points result;
  result.pose = {so3::exp(random.vector()), random.vector(3.0)};
  result.planes.resize(static_cast<std::size_t>(count));
  result.pose_jacobian.resize(count, 6);
  result.turning.resize(count, 3);
  result.normals.resize(count, 3);
  result.ages_s.resize(count);
  for (int i = 0; i < count; ++i) {
    // The beam rotates once in a scan: points ahead and points behind have different times.
    const double share = (i + 0.5) / count;
    const Vector3 point(10.0 * std::cos(2.0 * M_PI * share), 10.0 * std::sin(2.0 * M_PI * share),
                        i % 2 == 0 ? -1.0 : 2.0);
    Plane& plane = result.planes[static_cast<std::size_t>(i)];
    const Vector3 facing = i % 3 == 0 ? Vector3::UnitX() : i % 3 == 1 ? Vector3::UnitY() : Vector3::UnitZ();
    plane.normal = (result.pose.rotation * facing).cast<float>();
    plane.major = Eigen::Vector3f(plane.normal.unitOrthogonal());
    plane.center = (result.pose * point).cast<float>();
    Correspondence match{point.cast<float>(), &plane, static_cast<float>(variance_m2)};
    match.age_s = static_cast<float>(kStepS * (1.0 - share));
    result.matches.push_back(match);
    const Vector3 n = plane.normal.cast<double>();
    const Vector3 turning = match.point.cast<double>().cross(result.pose.rotation.conjugate() * n);
    result.pose_jacobian.row(i) << turning.transpose(), n.transpose();
    result.turning.row(i) = turning.transpose();
    result.normals.row(i) = n.transpose();
    result.ages_s[i] = static_cast<double>(match.age_s);
  }
  return result;
}

Deskewing deskewing_with(double gyroscope_density, double accelerometer_density) {
  Deskewing result;
  result.step_s = kStepS;
  result.gyroscope_density = gyroscope_density;
  result.accelerometer_density = accelerometer_density;
  return result;
}

Eigen::MatrixXd information_by(const SweptCost& swept, const CondensedCost& cost, const Pose& pose, bool both) {
  Eigen::Matrix<double, 25, 18> jacobian = Eigen::Matrix<double, 25, 18>::Zero();
  jacobian.topLeftCorner<13, 6>() = cost.coordinates_jacobian(pose);
  jacobian.bottomRightCorner<12, 12>().setIdentity();
  const Eigen::MatrixXd all = jacobian.transpose() * (both ? swept.given_both : swept.given_end) * jacobian;
  if (both) return all;
  // Pose and the slope at the end remain.
  Eigen::MatrixXd result(9, 9);
  result << all.topLeftCorner(6, 6), all.block(0, 9, 6, 3), all.block(9, 0, 3, 6), all.block(9, 9, 3, 3);
  return result;
}

/// Covariance of white noise integrated twice, backwards from the end of a step, at ages a and b.
double integrated_twice(double a, double b) {
  const double less = std::min(a, b);
  return less * less * (3.0 * std::max(a, b) - less) / 6.0;
}

/// The same if position and slope are known at the beginning of the step as well.
double integrated_bridge(double a, double b) {
  Eigen::Matrix2d far;
  far << std::pow(kStepS, 3) / 3.0, kStepS * kStepS / 2.0, kStepS * kStepS / 2.0, kStepS;
  const auto with_far = [](double age) {
    // Covariance of position and slope at the beginning with the position at this age.
    return Eigen::Vector2d(integrated_twice(age, kStepS), age * age / 2.0);
  };
  return integrated_twice(a, b) - with_far(a).dot(far.inverse() * with_far(b));
}

/// Jᵀ Σ⁻¹ J with the full covariance of the points' own noise and of the IMU's noise between the ends of the step.
Eigen::MatrixXd information_by_force(const Points& points, const Deskewing& deskewing, bool both) {
  const Eigen::Index count = points.ages_s.size();
  Eigen::MatrixXd covariance =
      static_cast<double>(points.matches.front().variance) * Eigen::MatrixXd::Identity(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const double a = points.ages_s[i];
      const double b = points.ages_s[j];
      // A Brownian motion backwards from the end; a bridge if the other end is known.
      double turn = deskewing.gyroscope_density * (std::min(a, b) - (both ? a * b / kStepS : 0.0));
      double shift = deskewing.accelerometer_density * (both ? integrated_bridge(a, b) : integrated_twice(a, b));
      if (!both) {
        turn += deskewing.gyroscope_bias_variance * a * b;
        shift += deskewing.acceleration_variance * a * a * b * b / 4.0;
      }
      covariance(i, j) += turn * points.turning.row(i).dot(points.turning.row(j)) +
                          shift * points.normals.row(i).dot(points.normals.row(j));
    }
  }
  Eigen::MatrixXd jacobian(count, both ? 18 : 9);
  if (both) {
    for (Eigen::Index i = 0; i < count; ++i) {
      const Hermite basis(points.ages_s[i], kStepS);
      jacobian.row(i) << points.pose_jacobian.row(i), basis.share * points.turning.row(i),
          basis.near_slope * points.normals.row(i), basis.far_position * points.normals.row(i),
          basis.far_slope * points.normals.row(i);
    }
  } else {
    jacobian << points.pose_jacobian, points.ages_s.asDiagonal() * points.normals;
  }
  return jacobian.transpose() * covariance.llt().solve(jacobian);
}

/// Largest and smallest ratio of two informations over all directions.
std::pair<double, double> ratios(const Eigen::MatrixXd& information, const Eigen::MatrixXd& reference) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(information, reference);
  return {solver.eigenvalues().minCoeff(), solver.eigenvalues().maxCoeff()};
}

TEST(SweptCost, KnowsWhatAPointByPointCovarianceOfTheNoiseKnows) {
  const Points points = points_round_the_robot(1, 300);
  const CondensedCost cost = condense(points.matches, points.pose);
  // From a tactical IMU to a useless one: 1 m/s²/√Hz.
  for (const auto& [gyroscope, accelerometer] :
       {std::pair(1e-8, 1e-8), std::pair(1e-6, 4e-4), std::pair(4e-6, 1e-2), std::pair(1e-5, 1.0)}) {
    const Deskewing deskewing = deskewing_with(gyroscope, accelerometer);
    const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing);
    for (const bool both : {true, false}) {
      const auto found =
          ratios(information_by(swept, cost, points.pose, both), information_by_force(points, deskewing, both));
      std::printf("gyroscope %.0e, accelerometer %.0e, %s: %.4f to %.4f\n", gyroscope, accelerometer,
                  both ? "both ends" : "the end", found.first, found.second);
      // Omitted modes count as information. Points of a bin share their age, which moves the ratio both ways.
      EXPECT_GT(found.first, 0.95) << gyroscope;
      EXPECT_LT(found.second, 1.15) << gyroscope;
    }
  }
}

TEST(SweptCost, TheFirstScanKnowsNoMoreThanTheBiasesItWasDeskewedWith) {
  const Points points = points_round_the_robot(4, 300);
  const CondensedCost cost = condense(points.matches, points.pose);
  Deskewing deskewing = deskewing_with(1e-8, 1e-8);
  const SweptCost without = sweep(cost, points.matches, points.pose, deskewing);
  deskewing.gyroscope_bias_variance = 4e-4;
  deskewing.acceleration_variance = 1.0;
  const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing);
  EXPECT_TRUE((swept.given_both == without.given_both));
  const Eigen::MatrixXd by_force = information_by_force(points, deskewing, false);
  const auto found = ratios(information_by(swept, cost, points.pose, false), by_force);
  EXPECT_GT(found.first, 0.95);
  EXPECT_LT(found.second, 1.05);
  EXPECT_GT(ratios(information_by(without, cost, points.pose, false), by_force).second, 10.0);
}

TEST(SweptCost, ADenseScanKnowsNoMoreThanTheGyroscopesLastMillisecondsLetIt) {
  // Equivalent to 6,000 points at 20 m with 1 cm of noise: the last few milliseconds determine the scan's end.
  const Points points = points_round_the_robot(3, 600, 2.5e-6);
  const CondensedCost cost = condense(points.matches, points.pose);
  const Deskewing deskewing = deskewing_with(1e-6, 4e-4);
  const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing);
  const auto pose_of = [](const Eigen::MatrixXd& information) -> Matrix6 {
    return information.inverse().topLeftCorner<6, 6>().inverse();
  };
  const auto both = ratios(pose_of(information_by(swept, cost, points.pose, true)),
                           pose_of(information_by_force(points, deskewing, true)));
  std::printf("information of the pose, by modes over by force: %.3f to %.3f\n", both.first, both.second);
  EXPECT_GT(both.first, 0.999);
  EXPECT_LT(both.second, 1.2);
}

TEST(SweptCost, WithoutNoiseItIsOneResidualAPoint) {
  RandomVectors random(9);
  const Points points = points_round_the_robot(2, 300);
  const CondensedCost cost = condense(points.matches, points.pose);
  const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing_with(1e-18, 1e-18));
  Vector6 step;
  step << 0.02, -0.01, 0.03, 0.2, -0.1, 0.05;
  Vector25 y;
  y << cost.coordinates(points.pose.boxplus(step)), 0.1 * random.vector(), random.vector(), 0.1 * random.vector(),
      random.vector();
  double sum = 0.0;
  for (std::size_t i = 0; i < points.matches.size(); ++i) {
    const Correspondence& match = points.matches[i];
    const auto row = static_cast<Eigen::Index>(i);
    const Vector3 place = points.pose.boxplus(step) * match.point.cast<double>();
    const Hermite basis(points.ages_s[row], kStepS);
    const double residual =
        match.plane->normal.cast<double>().dot(place - match.plane->center.cast<double>()) +
        basis.share * points.turning.row(row).dot(y.segment<3>(13)) +
        points.normals.row(row).dot(basis.near_slope * y.segment<3>(16) + basis.far_position * y.segment<3>(19) +
                                    basis.far_slope * y.tail<3>());
    sum += static_cast<double>(match.weight()) * residual * residual;
  }
  // Points of a bin, a sixty-fourth of the step, share their age.
  EXPECT_NEAR(y.dot(swept.given_both * y) / sum, 1.0, 1e-3);
  EXPECT_NEAR((square_root(swept.given_both) * y).squaredNorm() / sum, 1.0, 1e-3);
}

/// Where the cost of a scan without departure is least: Newton's method.
Pose least_of(const Matrix25& moment, CondensedCost cost, Pose pose) {
  cost.moment = moment.topLeftCorner<13, 13>();
  for (int i = 0; i < 10; ++i) pose = pose.boxplus(-cost.hessian(pose).ldlt().solve(cost.gradient(pose)));
  return pose;
}

TEST(SweptCost, ErrorsOfTheMapDoNotMoveTheBestPoseOfAStraightenedScan) {
  Points points = points_round_the_robot(5, 300);
  RandomVectors random(6);
  for (Correspondence& match : points.matches) match.point += random.vector(0.03).cast<float>();
  const CondensedCost cost = condense(points.matches, points.pose);
  const Deskewing deskewing = deskewing_with(1e-6, 4e-4);
  SharedMapError error{Matrix6::Identity() * 1e-4};
  error.pose_covariance.topLeftCorner<3, 3>() *= 0.01;
  const SweptCost exact = sweep(cost, points.matches, points.pose, deskewing);
  const SweptCost moved = sweep(cost, points.matches, points.pose, deskewing, error);
  error.straightened = true;
  const SweptCost straightened = sweep(cost, points.matches, points.pose, deskewing, error);
  const Pose best = least_of(exact.given_both, cost, points.pose);
  EXPECT_GT(least_of(moved.given_both, cost, points.pose).boxminus(best).norm(), 2e-3);
  EXPECT_LT(least_of(straightened.given_both, cost, points.pose).boxminus(best).norm(), 1e-4);
  // What the scan knows stays.
  for (const bool both : {true, false}) {
    const auto found =
        ratios(information_by(straightened, cost, points.pose, both), information_by(moved, cost, points.pose, both));
    EXPECT_NEAR(found.first, 1.0, 0.01);
    EXPECT_NEAR(found.second, 1.0, 0.01);
  }
}

TEST(SweptCost, AScanTakenAtOnceIsItsCondensedCost) {
  const Points points = points_round_the_robot(3, 100);
  const CondensedScan scan = condense_scan(points.matches, points.pose);
  for (const Matrix25& moment : {scan.swept.given_both, scan.swept.given_end}) {
    EXPECT_TRUE((moment.topLeftCorner<13, 13>() == scan.cost.moment));
    EXPECT_TRUE(moment.rightCols<12>().isZero(0.0));
  }
}

}  // namespace
}  // namespace lodestone
