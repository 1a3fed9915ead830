// What deskewing took wrongly, and what the noise of the IMU leaves in doubt, against brute force.
#include "core/lidar/swept_cost.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "core/lidar/square_root.h"

namespace lodestone {
namespace {

constexpr double kStepS = 0.1;
constexpr int kSamples = 20;

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
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

TEST(Deskewing, ItsRatesBringPointsBackThatAWrongGyroscopeAndVelocityDisplaced) {
  const NavState truth = end_state();
  const ScanMotion true_motion(truth, imu_samples(Vector3::Zero()));
  NavState guess = truth;
  guess.velocity += Vector3(0.02, -0.01, 0.03);
  const ScanMotion guessed_motion(guess, imu_samples({0.01, -0.02, 0.015}));
  const Deskewing deskewing(guess, guessed_motion, ImuNoise{});
  const Quaternion before = true_motion.pose(0).rotation;
  const Vector6 rates = deskewing.rates(&before, truth.T_map_imu.rotation, truth.velocity, nullptr);
  for (const double age_s : {0.0, 0.03, 0.07, 0.1}) {
    const Time time = from_seconds(kStepS - age_s);
    const Vector3 point(8.0, -5.0, 2.0);
    const Vector3 place = true_motion.pose(time) * point;
    const Vector3 deskewed = guessed_motion.relative_pose(time) * point;
    const Vector3 untouched = truth.T_map_imu * deskewed;
    const Vector3 corrected =
        truth.T_map_imu * (so3::exp(age_s * rates.head<3>()) * deskewed) + age_s * rates.tail<3>();
    // A turning platform spreads the error unevenly; that is of second order.
    EXPECT_LT((corrected - place).norm(), 0.05 * (untouched - place).norm() + 1e-9) << age_s;
  }
  // Where nothing is known of the pose before, the gyroscope is believed.
  const Vector3 guessed = truth.T_map_imu.rotation * guess.T_map_imu.rotation.conjugate() * guess.velocity;
  EXPECT_TRUE(deskewing.rates(nullptr, truth.T_map_imu.rotation, guessed, nullptr).isZero(1e-12));
}

TEST(Deskewing, AMapTurnedWithAllThatMovesInItTellsNothing) {
  Random random(12);
  Deskewing deskewing;
  deskewing.turn = so3::exp(random.vector(0.1));
  deskewing.velocity = random.vector();
  deskewing.step_s = kStepS;
  const Quaternion before = so3::exp(random.vector());
  const Quaternion end = before * so3::exp(random.vector(0.1));
  const Vector3 velocity = random.vector();
  const Quaternion turn = so3::exp(random.vector());
  const Quaternion before_turned = turn * before;
  const Vector6 rates = deskewing.rates(&before, end, velocity, nullptr);
  EXPECT_GT(rates.norm(), 1e-3);
  const Vector6 turned = deskewing.rates(&before_turned, turn * end, turn * velocity, nullptr);
  EXPECT_LT((turned.head<3>() - rates.head<3>()).norm(), 1e-12);
  EXPECT_LT((turned.tail<3>() - turn * Vector3(rates.tail<3>())).norm(), 1e-12);
}

struct Points {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
  Pose pose;
  Eigen::MatrixXd pose_jacobian;   // a row a point: φ, p
  Eigen::MatrixXd turning;         // p × Rᵀn
  Eigen::MatrixXd normals;
  Eigen::VectorXd ages_s;
};

Points points_round_the_robot(std::uint64_t seed, int count, double variance_m2 = 1e-4) {
  Random random(seed);
  Points result;
  result.pose = {so3::exp(random.vector()), random.vector(3.0)};
  result.planes.resize(static_cast<std::size_t>(count));
  result.pose_jacobian.resize(count, 6);
  result.turning.resize(count, 3);
  result.normals.resize(count, 3);
  result.ages_s.resize(count);
  for (int i = 0; i < count; ++i) {
    // The beam goes round once in a scan: what lies ahead is seen at another time than what lies behind.
    const double share = (i + 0.5) / count;
    const Vector3 point(10.0 * std::cos(2.0 * M_PI * share), 10.0 * std::sin(2.0 * M_PI * share), i % 2 == 0 ? -1.0 : 2.0);
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

Matrix19 information_by(const SweptCost& swept, const CondensedCost& cost, const Pose& pose, bool both) {
  Eigen::Matrix<double, 19, 12> jacobian = Eigen::Matrix<double, 19, 12>::Zero();
  jacobian.topLeftCorner<13, 6>() = cost.coordinates_jacobian(pose);
  jacobian.bottomRightCorner<6, 6>().setIdentity();
  Matrix19 result = Matrix19::Zero();
  result.topLeftCorner<12, 12>() = jacobian.transpose() * (both ? swept.given_both : swept.given_end) * jacobian;
  return result;
}

/// Jᵀ Σ⁻¹ J with the points' own noise and that of the IMU between the ends of the step written out point by point.
Eigen::MatrixXd information_by_force(const Points& points, const Deskewing& deskewing, bool both) {
  const Eigen::Index count = points.ages_s.size();
  Eigen::MatrixXd covariance =
      static_cast<double>(points.matches.front().variance) * Eigen::MatrixXd::Identity(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const double a = points.ages_s[i];
      const double b = points.ages_s[j];
      // Of a Brownian motion back from the end; pinned at the other end where that is known.
      const double turn = deskewing.gyroscope_density * (std::min(a, b) - (both ? a * b / kStepS : 0.0));
      const double shift = deskewing.accelerometer_density * std::pow(kStepS, 3) / 20.0;
      covariance(i, j) += turn * points.turning.row(i).dot(points.turning.row(j)) +
                          shift * points.normals.row(i).dot(points.normals.row(j));
    }
  }
  Eigen::MatrixXd jacobian(count, 12);
  jacobian << points.pose_jacobian, points.ages_s.asDiagonal() * points.turning, points.ages_s.asDiagonal() * points.normals;
  if (!both) jacobian.middleCols<3>(6).setZero();
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
  for (const double density : {1e-8, 1e-6, 4e-6}) {
    const Deskewing deskewing = deskewing_with(density, 4e-4);
    const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing);
    const auto both = ratios(information_by(swept, cost, points.pose, true).topLeftCorner<12, 12>(),
                             information_by_force(points, deskewing, true));
    // The modes hold all but a little of the bridge: what is left is taken for knowledge, at most so much.
    EXPECT_GT(both.first, 0.999) << density;
    EXPECT_LT(both.second, 1.15) << density;
    // Without the pose before, the rates of turning are no variables: pose and velocity remain.
    Eigen::Matrix<double, 12, 9> kept = Eigen::Matrix<double, 12, 9>::Zero();
    kept.topLeftCorner<6, 6>().setIdentity();
    kept.bottomRightCorner<3, 3>().setIdentity();
    const auto end = ratios(kept.transpose() * information_by(swept, cost, points.pose, false).topLeftCorner<12, 12>() * kept,
                            kept.transpose() * information_by_force(points, deskewing, false) * kept);
    EXPECT_GT(end.first, 0.999) << density;
    EXPECT_LT(end.second, 1.15) << density;
  }
}

TEST(SweptCost, ADenseScanKnowsNoMoreThanTheGyroscopesLastMillisecondsLetIt) {
  // As much as 6,000 points at 20 m with 1 cm of noise: the scan's end is told from its last few milliseconds.
  const Points points = points_round_the_robot(3, 600, 2.5e-6);
  const CondensedCost cost = condense(points.matches, points.pose);
  const Deskewing deskewing = deskewing_with(1e-6, 4e-4);
  const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing);
  const auto pose_of = [](const Eigen::MatrixXd& information) -> Matrix6 {
    return information.inverse().topLeftCorner<6, 6>().inverse();
  };
  const auto both = ratios(pose_of(information_by(swept, cost, points.pose, true).topLeftCorner<12, 12>()),
                           pose_of(information_by_force(points, deskewing, true)));
  std::printf("information of the pose, by modes over by force: %.3f to %.3f\n", both.first, both.second);
  EXPECT_GT(both.first, 0.999);
  EXPECT_LT(both.second, 1.2);
}

TEST(SweptCost, WithoutNoiseItIsOneResidualAPoint) {
  const Points points = points_round_the_robot(2, 300);
  const CondensedCost cost = condense(points.matches, points.pose);
  const SweptCost swept = sweep(cost, points.matches, points.pose, deskewing_with(1e-18, 1e-18));
  Vector6 step;
  step << 0.02, -0.01, 0.03, 0.2, -0.1, 0.05;
  Vector19 y;
  y << cost.coordinates(points.pose.boxplus(step)), Vector3(0.3, -0.1, 0.2), Vector3(-0.5, 0.4, 0.1);
  double sum = 0.0;
  for (std::size_t i = 0; i < points.matches.size(); ++i) {
    const Correspondence& match = points.matches[i];
    const auto row = static_cast<Eigen::Index>(i);
    const Vector3 place = points.pose.boxplus(step) * match.point.cast<double>();
    const double residual = match.plane->normal.cast<double>().dot(place - match.plane->center.cast<double>()) +
                            points.ages_s[row] * (points.turning.row(row).dot(y.segment<3>(13)) +
                                                  points.normals.row(row).dot(y.tail<3>()));
    sum += static_cast<double>(match.weight()) * residual * residual;
  }
  EXPECT_NEAR(y.dot(swept.given_both * y) / sum, 1.0, 1e-9);
  EXPECT_NEAR((square_root(swept.given_both) * y).squaredNorm() / sum, 1.0, 1e-9);
}

TEST(SweptCost, AScanTakenAtOnceIsItsCondensedCost) {
  const Points points = points_round_the_robot(3, 100);
  const CondensedScan scan = condense_scan(points.matches, points.pose);
  for (const Matrix19& moment : {scan.swept.given_both, scan.swept.given_end}) {
    EXPECT_TRUE((moment.topLeftCorner<13, 13>() == scan.cost.moment));
    EXPECT_TRUE(moment.rightCols<6>().isZero(0.0));
  }
}

}  // namespace
}  // namespace lodestone
