#include "factors/wheel_factor.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/imu/propagation.h"
#include "factors/sliding_window.h"
#include "factors/slip_factor.h"
#include "tests/factors/gradients.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

TEST(WheelFactor, PassesTheGradientChecker) {
  Random random(31);
  const PoseManifold pose_manifold;
  const ceres::EuclideanManifold<9> motion_manifold;
  const ceres::EuclideanManifold<kWheelParameters> calibration_manifold;
  const ceres::EuclideanManifold<1> slip_manifold;
  for (int i = 0; i < 5; ++i) {
    WheelReading reading;
    reading.measured_m_s = random.vector();
    reading.inverse_sigma_s_m = Vector3(50.0, 20.0, i % 2 == 0 ? 0.0 : 10.0);
    reading.by_velocity = so3::exp(random.vector()).toRotationMatrix();
    reading.by_gyroscope_bias = reading.by_velocity * so3::hat(random.vector());
    reading.rest = random.vector();
    const PoseBlock pose = block_of(random.pose());
    std::array<double, 9> motion;
    for (double& value : motion) value = random.normal();
    const double calibration[kWheelParameters] = {0.05, 0.2, -0.1, 0.3};
    const double slip = -0.04;
    expect_gradients(WheelFactor(reading), {&pose_manifold, &motion_manifold, &calibration_manifold, &slip_manifold},
                     {pose.data(), motion.data(), calibration, &slip}, 1e-5);
  }
}

TEST(SlipFactor, PassesTheGradientCheckerAndADetectedJumpCostsLittle) {
  const ceres::EuclideanManifold<1> manifold;
  const double before = 0.001, after = 0.05;
  const double* parameters[] = {&before, &after};
  double steady = 0.0, jumping = 0.0;
  for (const double jump : {0.0, 0.05}) {
    const SlipFactor step(0.005, 0.9, jump);
    expect_gradients(step, {&manifold, &manifold}, {&before, &after});
    step.Evaluate(parameters, jump > 0.0 ? &jumping : &steady, nullptr);
  }
  EXPECT_GT(steady, 20.0);
  EXPECT_LT(jumping, 1.0);
  expect_gradients(SlipFactor(0.005, 0.0, 0.0), {&manifold}, {&after});
}

/// A drive in a corridor along x: the scan observes all directions but x.
struct CorridorDrive {
  double slip = 0.0;     ///< of the wheels from 3 s to 5 s, relative
  bool detected = true;  ///< the window gets the sizes of the slip's jumps
  bool wheels = true;
  int keyframes = 70;
};

struct AlongCorridor {
  double error_m = 0.0;  ///< of the last position, along x
  double sigma_m = 0.0;
};

constexpr double kWheelSigma_m_s = 0.01;

AlongCorridor drive_along(const CorridorDrive& corridor, std::uint64_t seed) {
  Random random(seed);
  DriveOptions options;
  options.keyframes = corridor.keyframes;
  options.turn_scale = 0.1;
  const Drive truth = drive(options, random);
  CalibrationSigmas calibration = exact_calibration();
  calibration.wheels = {0.005, 0.1, 0.005};
  const Matrix17 start = start_covariance();
  SlidingWindow window(truth.times[0], truth.truth[0].boxplus(random.draw(start)), start, 0, options.noise, {},
                       calibration);
  const double scale = 0.005 * random.normal();
  double before = 0.0;  // slip at the previous keyframe
  const std::vector<Vector3> walls{Vector3::UnitY(), Vector3::UnitZ()};
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    window.add_keyframe(truth.times[k],
                        propagate(window.state(window.size() - 1), truth.samples[k], options.noise, nullptr),
                        truth.samples[k]);
    const std::size_t newest = window.size() - 1;
    const NavState& state = truth.truth[k];
    const Scan points = scan(state.T_map_imu, walls, 200, 0.02, 5.0, 0.0, random);
    window.set_lidar(newest, condense_scan(points.matches, window.state(newest).T_map_imu), points.matches, {});
    if (corridor.wheels) {
      const double seconds = to_seconds(truth.times[k]);
      const double slip = seconds > 3.0 && seconds <= 5.0 ? corridor.slip : 0.0;
      WheelReading reading;
      reading.by_velocity = Matrix3::Identity();
      reading.measured_m_s.x() = (1.0 + scale + slip) * (state.T_map_imu.rotation.conjugate() * state.velocity).x() +
                                 kWheelSigma_m_s * random.normal();
      reading.inverse_sigma_s_m.x() = 1.0 / kWheelSigma_m_s;
      reading.samples = 1;
      window.set_wheels(newest, reading, corridor.detected ? std::abs(slip - before) : 0.0);
      before = slip;
    }
    window.solve();
    if (window.size() > 25) window.marginalize_oldest();
  }
  const std::size_t newest = window.size() - 1;
  const Matrix6 covariance = window.pose_covariances(std::array<std::size_t, 1>{newest})[0];
  const double error_m = window.state(newest).T_map_imu.position.x() - truth.truth.back().T_map_imu.position.x();
  return {error_m, std::sqrt(covariance(3, 3))};
}

struct Statistics {
  double rms_m = 0.0;
  double normalized = 0.0;  ///< mean squared error in units of the variance
};

Statistics statistics(const CorridorDrive& corridor) {
  constexpr int kDrives = 10;
  Statistics result;
  for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
    const AlongCorridor one = drive_along(corridor, seed);
    result.rms_m += one.error_m * one.error_m / kDrives;
    result.normalized += std::pow(one.error_m / one.sigma_m, 2) / kDrives;
  }
  result.rms_m = std::sqrt(result.rms_m);
  return result;
}

TEST(SlidingWindow, WheelsObserveTheAxisOfACorridor) {
  const Statistics without = statistics({.wheels = false});
  const Statistics with = statistics({});
  EXPECT_LT(with.rms_m, 0.5 * without.rms_m);
  EXPECT_LT(with.normalized, 2.5);  // χ² of ten: 99 % lie below
}

TEST(SlidingWindow, ADetectedJumpOfTheSlipDoesNotMoveTheVelocity) {
  // Two seconds at about 1 m/s and 10 %: without the jump, the error is up to 0.2 m.
  const Statistics detected = statistics({.slip = 0.1});
  EXPECT_LT(detected.normalized, 2.5);
  const Statistics undetected = statistics({.slip = 0.1, .detected = false});
  EXPECT_LT(detected.rms_m, 0.7 * undetected.rms_m);
  EXPECT_GT(undetected.normalized, 2.0 * detected.normalized);
}

TEST(SlidingWindow, WheelCalibrationIsEstimatedWithItsSigma) {
  // The scale of a drive that LiDAR observes in all directions.
  Random random(7);
  DriveOptions options;
  const Drive truth = drive(options, random);
  CalibrationSigmas calibration = exact_calibration();
  calibration.wheels = {0.05, 1.0, 0.001};
  const Matrix17 start = start_covariance();
  SlidingWindow window(truth.times[0], truth.truth[0].boxplus(random.draw(start)), start, 0, options.noise, {},
                       calibration);
  EXPECT_EQ(window.wheel_correction(0).scale, 0.0);
  const std::vector<Vector3> normals = room_normals(random);
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    const NavState& state = truth.truth[k];
    window.add_keyframe(truth.times[k],
                        propagate(window.state(window.size() - 1), truth.samples[k], options.noise, nullptr),
                        truth.samples[k]);
    const std::size_t newest = window.size() - 1;
    const Scan points = scan(state.T_map_imu, normals, 200, 0.02, 5.0, 0.0, random);
    window.set_lidar(newest, condense_scan(points.matches, window.state(newest).T_map_imu), points.matches, {});
    WheelReading reading;
    reading.by_velocity = Matrix3::Identity();
    reading.measured_m_s = 1.03 * (state.T_map_imu.rotation.conjugate() * state.velocity) + random.vector(0.01);
    reading.inverse_sigma_s_m.setConstant(100.0);
    reading.samples = 1;
    window.set_wheels(newest, reading, 0.0);
    window.solve();
    if (window.size() > 20) window.marginalize_oldest();
  }
  const CalibrationEstimate::Wheels wheels = window.calibration_estimate().wheels;
  EXPECT_LT(wheels.scale_sigma, 0.02);
  EXPECT_GT(wheels.scale_sigma, 0.0);
  EXPECT_LT(std::abs(wheels.correction.scale - 0.03), 3.0 * wheels.scale_sigma);
  EXPECT_LT(wheels.turn_sigma_rad.z(), 0.9 * M_PI / 180.0);
  EXPECT_LT(std::abs(wheels.correction.turn_rad.z()), 3.0 * wheels.turn_sigma_rad.z());
}

}  // namespace
}  // namespace lodestone
