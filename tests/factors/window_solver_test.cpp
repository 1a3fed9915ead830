// The window's minimum and its covariances.
#include <gtest/gtest.h>

#include <array>

#include "core/imu/propagation.h"
#include "factors/sliding_window.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

/// A window over a short drive with LiDAR, IMU and magnetometers. `error`: of the predicted states, in initial sigmas.
struct SolvedWindow {
  SolvedWindow(double error, int max_iterations) {
    Random random(8);
    DriveOptions options;
    options.keyframes = 12;
    truth = drive(options, random);
    const std::vector<Vector3> normals = room_normals(random);
    const std::shared_ptr<const MagneticMap> map = wavy_map();
    SlidingWindowOptions window_options;
    window_options.max_iterations = max_iterations;
    window = std::make_unique<SlidingWindow>(0, truth.truth[0], start_covariance(), 3, options.noise, window_options);
    for (std::size_t k = 1; k < truth.truth.size(); ++k) {
      window->add_keyframe(truth.times[k], truth.truth[k], truth.samples[k]);
      const Scan points = scan(truth.truth[k].T_map_imu, normals, 100, 0.02, 5.0, 0.0, random);
      window->set_lidar(k, condense_scan(points.matches, truth.truth[k].T_map_imu), points.matches, {});
      window->set_field(
          k, map, FieldInterpolation::bicubic,
          field_readings(truth.truth[k].T_map_imu, *map, std::vector<Vector3>(3, Vector3::Zero()), 1.0, random), {});
    }
    for (std::size_t k = 0; k < truth.truth.size(); ++k) {
      Vector17 step = error * random.draw(start_covariance());
      step.tail<2>().setZero();  // one gravity for all keyframes
      window->set_state(k, window->state(k).boxplus(step));
    }
    iterations = window->solve();
    window->solve();  // IMU factors are integrated with the estimated biases
  }

  Drive truth;
  std::unique_ptr<SlidingWindow> window;
  int iterations = 0;
};

/// Distance of two windows: the largest over all keyframes, in sigmas of the first's poses.
double sigmas_apart(const SlidingWindow& a, const SlidingWindow& b) {
  std::vector<std::size_t> all(a.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  const std::vector<Matrix6> covariances = a.pose_covariances(all);
  double largest = 0.0;
  for (const std::size_t k : all) {
    const Vector6 difference = b.state(k).T_map_imu.boxminus(a.state(k).T_map_imu);
    largest = std::max(largest, std::sqrt(difference.dot(covariances[k].llt().solve(difference))));
  }
  return largest;
}

TEST(WindowSolver, FindsTheSameMinimumFromFarAway) {
  const SolvedWindow near(0.0, 50);
  const SolvedWindow far(8.0, 100);
  EXPECT_LT(near.iterations, 10);
  EXPECT_LT(sigmas_apart(*near.window, *far.window), 0.05);
}

TEST(WindowSolver, DampsAStepThatFails) {
  // So far away that steps without damping increase the cost: without a second solve, the window stays where it is.
  const SolvedWindow near(0.0, 50);
  const SolvedWindow far(120.0, SlidingWindowOptions{}.max_iterations);
  for (int i = 0; i < 10; ++i) far.window->solve();
  EXPECT_LT(sigmas_apart(*near.window, *far.window), 0.05);
}

// The IMU ties them so firmly to each other that a damping relative to this information stops their common motion.
TEST(WindowSolver, MovesTwoKeyframesThatAreMicrosecondsApart) {
  for (const Time step : {Time{100'000'000}, Time{1'000'000}, Time{60'000}}) {
    Random random(3);
    const std::vector<Vector3> normals = room_normals(random);
    ImuNoise noise;
    noise.accelerometer_noise_density = 5e-3;
    const NavState truth;
    NavState start;
    start.T_map_imu.position = Vector3(0.05, -0.04, 0.03);
    SlidingWindow window(0, start, start_covariance(), 0, noise, {});
    const std::vector<ImuSample> at_rest{{0, Vector3::Zero(), -start.gravity}, {step, Vector3::Zero(), -start.gravity}};
    window.add_keyframe(step, start, at_rest);
    for (std::size_t k = 0; k < 2; ++k) {
      const Scan points = scan(truth.T_map_imu, normals, 300, 0.02, 5.0, 0.0, random);
      window.set_lidar(k, condense_scan(points.matches, start.T_map_imu), points.matches, {});
    }
    window.solve();
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_LT(window.state(k).T_map_imu.position.norm(), 0.01) << step << " ns, keyframe " << k;
  }
}

TEST(WindowSolver, StopsWithATenthOfASigmaLeftAtMost) {
  const SolvedWindow stopped(1.0, 50);
  const SolvedWindow again(1.0, 50);
  for (int i = 0; i < 10; ++i) again.window->solve();
  EXPECT_LT(sigmas_apart(*again.window, *stopped.window), 0.1);
  EXPECT_LE(again.window->solve(), 1);
}

TEST(WindowSolver, NamesItself) {
  EXPECT_TRUE(SlidingWindow::solver_description().starts_with("ceres 2.") &&
              SlidingWindow::solver_description().ends_with(")"))
      << SlidingWindow::solver_description();
}

TEST(WindowCovariance, OfManyKeyframesIsThatOfEachAlone) {
  const SolvedWindow solved(1.0, 10);
  std::vector<std::size_t> all(solved.window->size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  const std::vector<Matrix6> together = solved.window->pose_covariances(all);
  for (const std::size_t k : all) {
    const Matrix6 alone = solved.window->pose_covariances(std::array{k}).front();
    EXPECT_LT((together[k] - alone).norm(), 1e-7 * alone.norm()) << k;
  }
}

TEST(WindowCovariance, FollowsEveryChangeOfTheWindow) {
  const SolvedWindow asked(1.0, 10);
  SlidingWindow& window = *asked.window;
  Random random(4);
  const std::size_t newest = window.size() - 1;
  const std::shared_ptr<const MagneticMap> map = wavy_map();
  const Pose& T_map_imu = asked.truth.truth[newest].T_map_imu;
  const Scan points = scan(T_map_imu, room_normals(random), 50, 0.05, 5.0, 0.0, random);
  const auto readings = field_readings(T_map_imu, *map, std::vector<Vector3>(3, Vector3::Zero()), 3.0, random);
  Pose step;
  step.position = Vector3(0.5, 0.2, 0.1);
  Matrix6 before = window.pose_covariances(std::array{newest}).front();
  const auto changes = [&](const char* what, const auto& change) {
    change();
    const Matrix6 after = window.pose_covariances(std::array{window.size() - 1}).front();
    EXPECT_GT((after - before).norm(), 1e-12 * before.norm()) << what;
    before = after;
  };
  changes("scan", [&] { window.set_lidar(newest, condense_scan(points.matches, T_map_imu), points.matches, {}); });
  changes("readings", [&] { window.set_field(newest, map, FieldInterpolation::bicubic, readings, {}); });
  changes("pose", [&] { window.set_field_pose(newest, {T_map_imu, 100.0 * Matrix6::Identity()}, {}); });
  changes("state", [&] { window.set_state(newest, window.state(newest).boxplus(0.01 * Vector17::Ones())); });
  changes("motion", [&] { window.move(step); });
  changes("solution", [&] { window.solve(); });
  changes("keyframe", [&] {
    window.add_keyframe(asked.truth.times.back() + from_seconds(0.1), window.state(newest), asked.truth.samples.back());
  });
}

TEST(WindowCovariance, OfTheNewestIsTheStartsThenTheOneThatTheImuPropagates) {
  Random random(5);
  DriveOptions options;
  options.keyframes = 4;
  const Drive truth = drive(options, random);
  Matrix17 covariance = start_covariance();
  covariance(tangent::position, tangent::velocity) = covariance(tangent::velocity, tangent::position) = 1e-3;
  SlidingWindow window(0, truth.truth[0], covariance, 0, options.noise, {});
  EXPECT_LT((window.newest_covariance().state - covariance).norm(), 1e-9 * covariance.norm());
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    const NavState predicted = propagate(window.state(k - 1), truth.samples[k], options.noise, &covariance);
    window.add_keyframe(truth.times[k], predicted, truth.samples[k]);
  }
  const Matrix17 found = window.newest_covariance().state;
  const Vector17 sigma = covariance.diagonal().cwiseSqrt();
  const Matrix17 difference =
      sigma.cwiseInverse().asDiagonal() * (found - covariance) * sigma.cwiseInverse().asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.02);
  EXPECT_LT((found.topLeftCorner<6, 6>() - window.pose_covariances(std::array{std::size_t{3}}).front()).norm(), 1e-12);
}

TEST(WindowCovariance, OfAVeryGoodImuIsThatOfItsStart) {
  // Information of 1e18 and more beside that of the initial prior: not positive definite in double precision.
  Random random(6);
  DriveOptions options;
  options.keyframes = 40;
  options.noise.gyroscope_noise_density = 1e-9;
  options.noise.accelerometer_noise_density = 1e-9;
  options.noise.gyroscope_bias_random_walk = 1e-10;
  options.noise.accelerometer_bias_random_walk = 1e-10;
  const Drive truth = drive(options, random);
  Matrix17 covariance = start_covariance();
  SlidingWindow window(0, truth.truth[0], covariance, 1, options.noise, {});
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    const NavState predicted = propagate(window.state(window.size() - 1), truth.samples[k], options.noise, &covariance);
    window.add_keyframe(truth.times[k], predicted, truth.samples[k]);
    const std::size_t newest = window.size() - 1;
    const Matrix6 found = window.pose_covariances(std::array{newest}).front();
    const Vector6 expected = covariance.topLeftCorner<6, 6>().diagonal().cwiseSqrt();
    for (int i = 0; i < 6; ++i)
      ASSERT_NEAR(std::sqrt(found(i, i)) / expected[i], 1.0, 0.05) << "keyframe " << k << ", " << i;
    if (window.size() > 10) window.marginalize_oldest();
  }
}

}  // namespace
}  // namespace lodestone
