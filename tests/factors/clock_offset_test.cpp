#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/imu/propagation.h"
#include "factors/random_walk_factor.h"
#include "factors/sliding_window.h"
#include "tests/factors/gradients.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

FieldReading moving_reading(Random& random, int magnetometer) {
  FieldReading reading{{so3::exp(random.vector(0.3)), random.vector(0.3)},
                       Vector3(20, 0, -40) + random.vector(5.0),
                       magnetometer,
                       1.5,
                       0.7};
  reading.velocity_m_s = random.vector(1.0);
  reading.turn_rad_s = random.vector(0.5);
  return reading;
}

TEST(FieldFactorWithClock, PassesTheGradientCheckerWithAndWithoutMask) {
  Random random(18);
  const PoseManifold pose_manifold;
  const ceres::EuclideanManifold<ceres::DYNAMIC> bias_manifold(6);
  const ceres::EuclideanManifold<1> clock_manifold;
  const ceres::EuclideanManifold<18> matrix_manifold;
  for (int i = 0; i < 5; ++i) {
    const Pose pose{so3::exp(random.vector(0.5)), random.vector(0.5)};
    std::vector<FieldReading> readings;
    for (int k = 0; k < 4; ++k) readings.push_back(moving_reading(random, k % 2));
    std::vector<double> biases(6);
    for (double& bias : biases) bias = random.normal();
    const double clock_s = 0.05 * random.normal();
    std::vector<double> matrices(18);
    for (double& value : matrices) value = 0.05 * random.normal();
    Matrix6 projector = Matrix6::Zero();
    projector(3, 3) = 1.0;
    for (const PoseMask& mask : {PoseMask{}, PoseMask(projector, pose)}) {
      const FieldFactor factor(wavy_map(), FieldInterpolation::bicubic, 2, readings, mask, {.clock = true});
      const PoseBlock block = block_of(pose.boxplus(0.02 * Vector6::Ones()));
      expect_gradients(factor, {&pose_manifold, &bias_manifold, &clock_manifold},
                       {block.data(), biases.data(), &clock_s}, 1e-5);
      const FieldFactor calibrating(wavy_map(), FieldInterpolation::bicubic, 2, readings, mask,
                                    {.clock = true, .matrices = true});
      expect_gradients(calibrating, {&pose_manifold, &bias_manifold, &clock_manifold, &matrix_manifold},
                       {block.data(), biases.data(), &clock_s, matrices.data()}, 1e-5);
    }
  }
}

TEST(FieldFactorWithClock, IsTheFactorWithoutWhereTheClockIsRight) {
  Random random(19);
  const std::vector<FieldReading> readings{moving_reading(random, 0), moving_reading(random, 0)};
  const PoseBlock block = block_of({so3::exp(random.vector(0.5)), random.vector(0.5)});
  const Vector3 bias = random.vector(1.0);
  const double clock_s = 0.0;
  const double* parameters[] = {block.data(), bias.data(), &clock_s};
  Vector6 with, without;
  FieldFactor(wavy_map(), FieldInterpolation::bicubic, 1, readings, {}, {.clock = true})
      .Evaluate(parameters, with.data(), nullptr);
  FieldFactor(wavy_map(), FieldInterpolation::bicubic, 1, readings, {}).Evaluate(parameters, without.data(), nullptr);
  EXPECT_LT((with - without).norm(), 1e-12);
}

TEST(RandomWalkFactor, OfOneBlockIsAPriorAboutZeroAndJumpsCostLittle) {
  const ceres::EuclideanManifold<6> manifold;
  RandomWalkFactor factor(6, 0.5, true);
  Vector6 value;
  value << 0.1, -0.2, 0.3, 20.0, 30.0, -10.0;
  factor.renew(nullptr, value.data());
  expect_gradients(factor, {&manifold}, {value.data()});
  const double* parameters[] = {value.data()};
  Vector6 residual;
  factor.Evaluate(parameters, residual.data(), nullptr);
  // Within its sigma the walk has full weight; beyond it, each sensor alone gets the weight of a Student distribution
  // with four degrees of freedom.
  EXPECT_LT((residual.head<3>() - value.head<3>() / 0.5).norm(), 1e-12);
  EXPECT_LT(residual.tail<3>().norm(), std::sqrt(7.0));
  EXPECT_GT(residual.tail<3>().norm(), 2.5);
}

/// A drive whose readings were taken `late_s` before their stamps.
SlidingWindow::ClockOffset estimate_clock(double late_s, double sigma_s, std::uint64_t seed) {
  Random random(seed);
  DriveOptions options;
  options.keyframes = 60;
  const Drive truth = drive(options, random);
  const auto map = wavy_map();
  CalibrationSigmas calibration = exact_calibration();
  calibration.magnetometers.clock_sigma_s = sigma_s;
  const Matrix17 start = start_covariance();
  SlidingWindow window(truth.times[0], truth.truth[0].boxplus(random.draw(start)), start, 3, options.noise, {},
                       calibration);
  const std::vector<Vector3> normals = room_normals(random);
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    window.add_keyframe(truth.times[k],
                        propagate(window.state(window.size() - 1), truth.samples[k], options.noise, nullptr),
                        truth.samples[k]);
    const std::size_t newest = window.size() - 1;
    const Pose& pose = truth.truth[k].T_map_imu;
    const Scan points = scan(pose, normals, 200, 0.02, 5.0, 0.0, random);
    window.set_lidar(newest, condense_scan(points.matches, window.state(newest).T_map_imu), points.matches, {});
    const Vector3 turn = truth.samples[k].back().angular_velocity;
    std::vector<FieldReading> readings;
    for (int i = 0; i < 3; ++i) {
      FieldReading reading;
      reading.T_end_mag.position = Vector3(0.3, 0.2 * i - 0.2, -0.1);
      reading.magnetometer = i;
      reading.sigma_ut = 0.5;
      reading.velocity_m_s =
          pose.rotation.conjugate() * truth.truth[k].velocity + turn.cross(reading.T_end_mag.position);
      reading.turn_rad_s = turn;
      const Pose then = pose * reading.T_end_mag_at(late_s);
      reading.measured_ut =
          then.rotation.conjugate() * map->query(then.position, FieldInterpolation::bicubic)->field_ut +
          random.vector(0.5);
      readings.push_back(reading);
    }
    window.set_field(newest, map, FieldInterpolation::bicubic, readings, {});
    window.solve();
    window.pose_covariances(std::array<std::size_t, 1>{newest});
    if (window.size() > 20) window.marginalize_oldest();
  }
  return window.clock_offset();
}

TEST(SlidingWindow, EstimatesHowLateTheMagnetometersStampsAreAndHowWellItKnows) {
  for (const double late_s : {-0.05, 0.0, 0.05}) {
    double squared = 0.0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const auto clock = estimate_clock(late_s, 0.05, seed);
      EXPECT_LT(clock.sigma_s, 0.01) << late_s;
      squared += std::pow((clock.offset_s - late_s) / clock.sigma_s, 2) / 5.0;
    }
    EXPECT_LT(squared, 3.0) << late_s;  // χ² of five: 99 % lie below
  }
  const auto off = estimate_clock(0.05, 0.0, 1);
  EXPECT_EQ(off.offset_s, 0.0);
  EXPECT_EQ(off.sigma_s, 0.0);
}

}  // namespace
}  // namespace lodestone
