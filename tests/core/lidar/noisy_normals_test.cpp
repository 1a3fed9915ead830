// Spurious information of a map's noisy normals, and its correction, against drawn maps.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "core/lidar/condensed_cost.h"

namespace lodestone {
namespace {

constexpr double kNoiseM = 0.01;
constexpr double kTiltRad = 0.02;
constexpr double kLeverM = 0.07;  // of points about the centres of their planes
constexpr double kAway_m = 0.04;

struct Errors {
  double step_m = 0.0;  // of the estimate along the weak axis, from the linearization point
  double corrected_m = 0.0;
  double nees = 0.0;  // of the pose, per degree of freedom
  double corrected_nees = 0.0;
};

/// A floor, two long walls and a few points that constrain the axis. The robot is `kAway_m` ahead of the linearization
/// point.
Errors errors_of_one(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr int kCount = 1500;
  std::vector<Plane> planes(kCount);
  std::vector<Correspondence> matches;
  Vector6 truth = Vector6::Zero();
  truth[3] = kAway_m;
  const Pose pose = Pose{}.boxplus(truth);
  for (int i = 0; i < kCount; ++i) {
    const Vector3 facing = i % 300 == 0 ? Vector3::UnitX() : i % 2 == 0 ? Vector3::UnitZ() : Vector3::UnitY();
    const Vector3 side = facing.unitOrthogonal();
    const Vector3 other = facing.cross(side);
    const Vector3 point(8.0 * uniform(generator), 8.0 * uniform(generator), 2.0 * uniform(generator));
    Plane& plane = planes[static_cast<std::size_t>(i)];
    const Vector3 tilted = (facing + kTiltRad * (normal(generator) * side + normal(generator) * other)).normalized();
    plane.normal = tilted.cast<float>();
    plane.major = Eigen::Vector3f(plane.normal.unitOrthogonal());
    // The surface is unbounded: the position of the plane's centre depends on the assumed position of the point.
    const Vector3 thought = point + kLeverM * (normal(generator) * side + normal(generator) * other);
    const double height = facing.dot(pose * point - thought) + kNoiseM * normal(generator);
    plane.center = (thought + height * facing).cast<float>();
    plane.major_tilt_variance = plane.minor_tilt_variance = static_cast<float>(kTiltRad * kTiltRad);
    const double variance = kNoiseM * kNoiseM + 2.0 * kTiltRad * kTiltRad * kLeverM * kLeverM;
    matches.push_back({point.cast<float>(), &plane, static_cast<float>(variance)});
  }
  const CondensedCost cost = condense(matches, Pose{});
  const Matrix6 information = cost.hessian(Pose{});
  const Vector6 gradient = cost.gradient(Pose{});
  const Matrix6 share = cost.seen_share(Pose{});
  const Matrix6 corrected = share.transpose() * information * share;
  const Vector6 step = -information.ldlt().solve(gradient);
  const Vector6 corrected_step = -corrected.ldlt().solve(share.transpose() * gradient);
  const auto nees = [&](const Vector6& estimate, const Matrix6& known) {
    return (estimate - truth).dot(known * (estimate - truth)) / 6.0;
  };
  return {step[3], corrected_step[3], nees(step, information), nees(corrected_step, corrected)};
}

TEST(SeenShare, GivesBackTheStepAndTheInformationThatNoisyNormalsTake) {
  constexpr int kRuns = 400;
  Errors mean;
  for (int run = 0; run < kRuns; ++run) {
    const Errors one = errors_of_one(500 + static_cast<std::uint64_t>(run));
    mean.step_m += one.step_m / kRuns;
    mean.corrected_m += one.corrected_m / kRuns;
    mean.nees += one.nees / kRuns;
    mean.corrected_nees += one.corrected_nees / kRuns;
  }
  std::printf("step %.1f mm, corrected %.1f of %.1f mm; NEES %.2f, corrected %.2f\n", 1e3 * mean.step_m,
              1e3 * mean.corrected_m, 1e3 * kAway_m, mean.nees, mean.corrected_nees);
  // Without the correction: drawn to the linearization point, and overconfident.
  EXPECT_LT(mean.step_m, 0.95 * kAway_m);
  EXPECT_NEAR(mean.corrected_m, kAway_m, 0.02 * kAway_m);
  const double spread = 4.0 * std::sqrt(2.0 / (6.0 * kRuns));
  EXPECT_NEAR(mean.corrected_nees, 1.0, spread + 0.05);
  EXPECT_GT(mean.nees, mean.corrected_nees + spread);
}

TEST(SeenShare, IsAllWhereNormalsAreExact) {
  std::vector<Plane> planes(30);
  std::vector<Correspondence> matches;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const double angle = 0.7 * static_cast<double>(i);
    planes[i].normal =
        Eigen::Vector3d(std::cos(angle), std::sin(angle), std::cos(3.0 * angle)).normalized().cast<float>();
    planes[i].major = Eigen::Vector3f(planes[i].normal.unitOrthogonal());
    matches.push_back(
        {Eigen::Vector3d(5.0 * std::sin(angle), 2.0, 3.0 * std::cos(2.0 * angle)).cast<float>(), &planes[i], 1e-4F});
  }
  EXPECT_LT((condense(matches, Pose{}).seen_share(Pose{}) - Matrix6::Identity()).norm(), 1e-6);
}

}  // namespace
}  // namespace lodestone
