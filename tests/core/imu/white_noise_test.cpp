// White noise of an IMU, estimated from its samples.
#include "core/imu/white_noise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

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

/// Scans of an IMU at 1 kHz at rest. `reading(i, component)`: of sample i, without gravity.
ImuWhiteNoise noise_at_1khz(int scans, const std::function<double(int, int)>& reading) {
  ImuWhiteNoise result;
  for (int scan = 0; scan < scans; ++scan) {
    std::vector<ImuSample> samples;
    for (int i = 100 * scan; i <= 100 * scan + 100; ++i) {
      ImuSample sample{from_seconds(1e-3 * i), Vector3::Zero(), Vector3::Zero()};
      for (int axis = 0; axis < 3; ++axis) {
        sample.angular_velocity[axis] = reading(i, axis);
        sample.linear_acceleration[axis] = reading(i, 3 + axis) + (axis == 2 ? 9.8 : 0.0);
      }
      samples.push_back(sample);
    }
    result.add(samples);
  }
  return result;
}

/// `series[component][i]`: white noise with a density of one, sampled at 1 kHz.
std::array<std::vector<double>, 6> white_series(int count) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0.0, std::sqrt(1000.0));
  std::array<std::vector<double>, 6> result;
  for (std::vector<double>& series : result) {
    for (int i = 0; i < count; ++i) series.push_back(normal(generator));
  }
  return result;
}

TEST(ImuWhiteNoise, ALowPassFilterOfAFastImuDoesNotHideItsNoise) {
  constexpr double kDensity = 1e-2;
  std::array<std::vector<double>, 6> series = white_series(2001);
  // Two poles at 60 Hz: 40 Hz of bandwidth.
  const double share = 1.0 - std::exp(-2.0 * M_PI * 60.0 / 1000.0);
  for (std::vector<double>& values : series) {
    for (int pole = 0; pole < 2; ++pole) {
      double state = 0.0;
      for (double& value : values) value = state += share * (value - state);
    }
  }
  ImuNoise stated;
  stated.gyroscope_noise_density = kDensity;
  stated.accelerometer_noise_density = kDensity;
  const ImuWhiteNoise seen = noise_at_1khz(20, [&](int i, int component) {
    return kDensity * series[static_cast<std::size_t>(component)][static_cast<std::size_t>(i)];
  });
  EXPECT_EQ(seen.bound(stated).gyroscope_noise_density, kDensity);
  EXPECT_EQ(seen.bound(stated).accelerometer_noise_density, kDensity);
  // A statement that is far too large is still bounded.
  stated.gyroscope_noise_density = 100.0 * kDensity;
  EXPECT_LT(seen.bound(stated).gyroscope_noise_density, 10.0 * kDensity);
}

TEST(ImuWhiteNoise, SamplesThatADriverInterpolatesDoNotHideTheirNoise) {
  constexpr double kDensity = 1e-2;
  const std::array<std::vector<double>, 6> series = white_series(2001);
  ImuNoise stated;
  stated.gyroscope_noise_density = kDensity;
  stated.accelerometer_noise_density = kDensity;
  for (const int every : {4, 6, 16, 40}) {
    const ImuWhiteNoise seen = noise_at_1khz(20, [&](int i, int component) {
      const std::vector<double>& own = series[static_cast<std::size_t>(component)];
      const double share = static_cast<double>(i % every) / every;
      const auto before = static_cast<std::size_t>(i / every);
      // A slow sensor averages its noise over its own period. Messages have floats.
      const double value = kDensity / std::sqrt(every) * ((1.0 - share) * own[before] + share * own[before + 1]);
      return component == 5 ? static_cast<double>(static_cast<float>(value + 9.8)) - 9.8 : value;
    });
    // Samples 5 ms apart still show a part of the noise of a sensor at 62.5 Hz.
    const double least = every == 16 ? 0.25 * kDensity : kDensity;
    EXPECT_GE(seen.bound(stated).gyroscope_noise_density, least) << every;
    EXPECT_GE(seen.bound(stated).accelerometer_noise_density, least) << every;
  }
}

}  // namespace
}  // namespace lodestone
