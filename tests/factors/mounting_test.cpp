// A LiDAR whose mounting and clock differ from the platform file's, on a rotating robot.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "core/imu/propagation.h"
#include "factors/seen_pose.h"
#include "factors/sliding_window.h"
#include "tests/factors/swept_room.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;

Vector7 mounting_sigmas(const CalibrationSigmas& calibration) {
  Vector7 result;
  result << Vector3::Constant(calibration.lidar.rotation_sigma_deg * M_PI / 180.0),
      Vector3::Constant(calibration.lidar.translation_sigma_m), calibration.lidar.clock_sigma_s;
  return result;
}

/// Pose of the LiDAR at the end of each interval by its stamps.
std::vector<Pose> seen_by(const LidarCorrection& truth, const Pose& before, const std::vector<Pose>& between,
                          double interval_s) {
  std::vector<Pose> result;
  for (std::size_t i = 0; i < between.size(); ++i) {
    const Pose& last = i == 0 ? before : between[i - 1];
    const double share = truth.clock_s / interval_s;
    const Vector3 turn = so3::log(last.rotation.conjugate() * between[i].rotation);
    const Pose then{between[i].rotation * so3::exp(-share * turn),
                    between[i].position - share * (between[i].position - last.position)};
    result.push_back(then * truth.corrected(Pose{}));
  }
  return result;
}

/// Errors of rotation, shift and clock over their sigmas, after a drive with a randomly drawn mounting.
Vector7 errors_over_sigmas(std::uint64_t seed) {
  constexpr std::size_t kWindow = 15;
  Random random(seed);
  DriveOptions options;
  options.keyframes = 60;
  options.turn_scale = 10.0;
  CalibrationSigmas calibration = exact_calibration();
  calibration.lidar = {0.3, 0.3, 0.003};
  const Vector7 sigmas = mounting_sigmas(calibration);
  Vector7 drawn;
  for (int i = 0; i < 7; ++i) drawn[i] = sigmas[i] * random.normal();
  const LidarCorrection truth{drawn.head<3>(), drawn.segment<3>(3), drawn[6]};

  const Drive robot = drive(options, random);
  const std::vector<Vector3> normals = room_normals(random);
  const Matrix17 covariance = start_covariance();
  SlidingWindowOptions without_map_error;
  without_map_error.map_error_states = false;
  SlidingWindow window(0, robot.truth[0].boxplus(random.draw(covariance)), covariance, 0, options.noise,
                       without_map_error, calibration);
  for (std::size_t k = 1; k < robot.truth.size(); ++k) {
    window.add_keyframe(robot.times[k],
                        propagate(window.state(window.size() - 1), robot.samples[k], options.noise, nullptr),
                        robot.samples[k]);
    const std::size_t newest = window.size() - 1;
    const std::size_t intervals = robot.between[k].size();
    const Sweep sweep = sweep_of(seen_by(truth, robot.truth[k - 1].T_map_imu, robot.between[k],
                                         options.period_s / static_cast<double>(intervals)),
                                 normals, 30, random);
    for (int pass = 0; pass < 2; ++pass) {
      const NavState state = window.state(newest);
      const ScanMotion motion(window.state(newest - 1), state, robot.samples[k]);
      const LidarCorrection correction = window.lidar_correction();
      const std::vector<Correspondence> matches = deskewed(sweep, motion, options.period_s, intervals, correction);
      CondensedScan scan = condense_scan(matches, state.T_map_imu, Deskewing(state, motion, options.noise));
      scan.by_lidar = true;
      scan.correction = correction;
      scan.beam_origin_m = correction.shift_m;
      window.set_lidar(newest, scan, matches, {});
      window.solve();
    }
    if (window.size() > kWindow) window.marginalize_oldest();
  }
  const CalibrationEstimate estimate = window.calibration_estimate();
  Vector7 errors;
  errors << (estimate.lidar.correction.turn_rad - truth.turn_rad).cwiseQuotient(estimate.lidar.turn_sigma_rad),
      (estimate.lidar.correction.shift_m - truth.shift_m).cwiseQuotient(estimate.lidar.shift_sigma_m),
      (estimate.lidar.correction.clock_s - truth.clock_s) / estimate.lidar.clock_sigma_s;
  return errors;
}

TEST(SeenState, ItsVelocityIsThatOfThePlaceThatIsSeen) {
  Random random(5);
  CondensedScan scan;
  scan.by_lidar = true;
  scan.deskewing.step_s = 0.1;
  scan.correction = {random.vector(0.01), random.vector(0.1), 0.001};
  scan.beam_origin_m = random.vector(0.5);
  Vector7 calibration;
  calibration << random.vector(0.05), random.vector(0.3), 0.004;
  const MotionRates rates{random.vector(0.5), random.vector()};
  const NavState middle = [&] {
    NavState state;
    state.T_map_imu = {so3::exp(random.vector()), random.vector(10.0)};
    state.velocity = random.vector(2.0);
    return state;
  }();
  const auto seen_after = [&](double seconds) {
    NavState state = middle;
    const Vector3 acceleration = middle.T_map_imu.rotation * rates.acceleration;
    state.T_map_imu.rotation = middle.T_map_imu.rotation * so3::exp(seconds * rates.turn_rate);
    state.T_map_imu.position += seconds * middle.velocity + 0.5 * seconds * seconds * acceleration;
    state.velocity += seconds * acceleration;
    const Vector3 acceleration_then = state.T_map_imu.rotation.conjugate() * acceleration;
    return SeenState(scan, state, {rates.turn_rate, acceleration_then}, calibration.data()).state;
  };
  constexpr double kStep_s = 1e-4;
  const Vector3 velocity =
      (seen_after(kStep_s).T_map_imu.position - seen_after(-kStep_s).T_map_imu.position) / (2.0 * kStep_s);
  EXPECT_LT((velocity - seen_after(0.0).velocity).norm(), 1e-5);
}

// The LiDAR's clock would explain the keyframe's noise (docs/design/041).
TEST(MotionRates, DoNotDependOnTheNoiseOfTheKeyframeItselfWhateverTheStepsAre) {
  constexpr double kTurn_rad_s = 0.4;
  const Vector3 acceleration_m_s2(0.3, -0.2, 0.1);
  const auto state_at = [&](double time_s) {
    NavState state;
    state.T_map_imu.rotation = so3::exp(Vector3(0.0, 0.0, kTurn_rad_s * time_s));
    state.velocity = time_s * acceleration_m_s2;
    return state;
  };
  for (const double after_s : {0.1, 0.2, 1.0}) {
    const NavState before = state_at(-0.1);
    const NavState after = state_at(after_s);
    const MotionRates exact = rates_between(&before, state_at(0.0), &after, 0.1 + after_s);
    NavState noisy = state_at(0.0);
    noisy.T_map_imu.rotation = so3::exp(Vector3(0.0, 0.0, 0.01));
    noisy.velocity += Vector3(0.02, 0.01, 0.03);
    const MotionRates found = rates_between(&before, noisy, &after, 0.1 + after_s);
    EXPECT_NEAR(exact.turn_rate.z(), kTurn_rad_s, 1e-12);
    EXPECT_LT((found.turn_rate - exact.turn_rate).norm(), 1e-12) << after_s;
    // In axes of the imu, which the noise turns.
    EXPECT_LT((noisy.T_map_imu.rotation * found.acceleration - acceleration_m_s2).norm(), 1e-12) << after_s;
  }
}

TEST(MountingOfALidar, ErrorsAreWhatTheirSigmasSayWhenTheRobotTurns) {
  constexpr int kRuns = 60;
  Vector7 mean = Vector7::Zero();
  for (int run = 0; run < kRuns; ++run) mean += errors_over_sigmas(700 + run).cwiseAbs2() / kRuns;
  std::printf("squared errors over variances: turn %.2f %.2f %.2f, shift %.2f %.2f %.2f, clock %.2f\n", mean[0],
              mean[1], mean[2], mean[3], mean[4], mean[5], mean[6]);
  // Four sigmas of a mean of χ² values.
  const double spread = 4.0 * std::sqrt(2.0 / kRuns);
  EXPECT_LT(mean.maxCoeff(), 1.0 + spread);
  EXPECT_NEAR(mean.mean(), 1.0, spread / std::sqrt(7.0));
}

}  // namespace
}  // namespace lodestone
