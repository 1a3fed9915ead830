// White noise of an IMU, estimated from its samples.
#include "core/imu/white_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lodestone {
namespace {

/// Scans of an IMU at 200 Hz that rotates and shakes, with white noise of these densities.
ImuWhiteNoise noise_of(double gyroscope, double accelerometer, int scans, double quantum = 0.0) {
  constexpr double kStepS = 0.005;
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  const auto sampled = [&](double value, double density) {
    const double noisy = value + density / std::sqrt(kStepS) * normal(generator);
    return quantum > 0.0 ? std::round(noisy / quantum) * quantum : noisy;
  };
  ImuWhiteNoise result;
  for (int scan = 0; scan < scans; ++scan) {
    std::vector<ImuSample> samples;
    for (int i = 0; i <= 20; ++i) {
      const double t = 0.1 * scan + kStepS * i;
      ImuSample sample{from_seconds(t), Vector3::Zero(), Vector3::Zero()};
      for (int axis = 0; axis < 3; ++axis) {
        sample.angular_velocity[axis] = sampled(0.5 * std::sin(3.0 * t + axis), gyroscope);
        sample.linear_acceleration[axis] = sampled(2.0 * std::cos(4.0 * t + axis), accelerometer);
      }
      samples.push_back(sample);
    }
    result.add(samples);
  }
  return result;
}

TEST(ImuWhiteNoise, ATrueStatementIsBelievedAndOneFarAboveTheNoiseIsBounded) {
  ImuNoise stated;
  stated.gyroscope_noise_density = 1e-3;
  stated.accelerometer_noise_density = 2e-2;
  const ImuWhiteNoise seen = noise_of(1e-3, 2e-2, 20);
  EXPECT_EQ(seen.bound(stated).gyroscope_noise_density, stated.gyroscope_noise_density);
  EXPECT_EQ(seen.bound(stated).accelerometer_noise_density, stated.accelerometer_noise_density);
  stated.gyroscope_noise_density = 0.5;
  stated.accelerometer_noise_density = 9.0;
  EXPECT_NEAR(seen.bound(stated).gyroscope_noise_density, 1e-2, 1.5e-3);
  EXPECT_NEAR(seen.bound(stated).accelerometer_noise_density, 0.2, 0.03);
}

TEST(ImuWhiteNoise, AStatementBelowTheNoiseIsRaisedAndVibrationIsNotTakenForNoise) {
  ImuNoise stated;
  stated.gyroscope_noise_density = 5e-4;
  stated.accelerometer_noise_density = 1e-2;
  const ImuNoise twice = noise_of(1e-3, 2e-2, 20).bound(stated);
  // 0.9 of the true density; the found one has bins of 9 %.
  EXPECT_NEAR(twice.gyroscope_noise_density, 0.9e-3, 1e-4);
  EXPECT_NEAR(twice.accelerometer_noise_density, 1.8e-2, 2e-3);
  EXPECT_EQ(twice.gyroscope_bias_random_walk, stated.gyroscope_bias_random_walk);
  const ImuNoise shaken = noise_of(1e-1, 2.0, 20).bound(stated);
  EXPECT_DOUBLE_EQ(shaken.gyroscope_noise_density, 3.0 * stated.gyroscope_noise_density);
  EXPECT_DOUBLE_EQ(shaken.accelerometer_noise_density, 3.0 * stated.accelerometer_noise_density);
}

TEST(ImuWhiteNoise, FewOrQuantizedSamplesProveNothing) {
  const ImuNoise stated;
  EXPECT_EQ(ImuWhiteNoise().bound(stated).gyroscope_noise_density, stated.gyroscope_noise_density);
  const ImuWhiteNoise quantized = noise_of(1e-6, 1e-5, 20, 10.0);
  EXPECT_EQ(quantized.bound(stated).gyroscope_noise_density, stated.gyroscope_noise_density);
  EXPECT_EQ(quantized.bound(stated).accelerometer_noise_density, stated.accelerometer_noise_density);
}

}  // namespace
}  // namespace lodestone
