// Noise of a gap of the IMU, against random motions.
#include "core/imu/gap_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lodestone {
namespace {

TEST(GapNoise, IsThatOfTheIntegralOfARandomMotionBesideTheMeanOfItsEnds) {
  constexpr double kStep_s = 0.002;
  constexpr int kMotions = 4000;
  ImuNoise stated;
  stated.gyroscope_noise_density = 0.0;
  stated.accelerometer_noise_density = 0.0;
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  for (const double gap_s : {0.1, 0.5, 2.0}) {
    double squares = 0.0;
    for (int motion = 0; motion < kMotions; ++motion) {
      double rate = normal(generator);  // of unit variance, correlated over a second
      const double first = rate;
      double turn = 0.0;
      for (double t = 0.0; t < gap_s - 0.5 * kStep_s; t += kStep_s) {
        const double kept = std::exp(-kStep_s);
        const double next = kept * rate + std::sqrt(1.0 - kept * kept) * normal(generator);
        turn += 0.5 * kStep_s * (rate + next);
        rate = next;
      }
      squares += std::pow(turn - 0.5 * gap_s * (first + rate), 2);
    }
    const double density = std::sqrt(squares / kMotions / gap_s);
    const ImuNoise noise = with_gap(stated, gap_s);
    EXPECT_NEAR(noise.gyroscope_noise_density / (0.5 * density), 1.0, 0.04) << gap_s;
    EXPECT_NEAR(noise.accelerometer_noise_density / (1.0 * density), 1.0, 0.04) << gap_s;
  }
}

TEST(GapNoise, IsNothingForSamplesAtTheirRateAndNeverBelowTheStatement) {
  const ImuNoise stated;
  EXPECT_EQ(with_gap(stated, 1.0 / stated.rate_hz).gyroscope_noise_density, stated.gyroscope_noise_density);
  EXPECT_EQ(with_gap(stated, 4.9 / stated.rate_hz).accelerometer_noise_density, stated.accelerometer_noise_density);
  double before = stated.gyroscope_noise_density;
  for (const double gap_s : {0.05, 0.2, 1.0, 2.0, 100.0}) {
    const double density = with_gap(stated, gap_s).gyroscope_noise_density;
    EXPECT_GE(density, before);
    before = density;
  }
  EXPECT_EQ(with_gap(stated, 100.0).gyroscope_bias_random_walk, stated.gyroscope_bias_random_walk);
}

}  // namespace
}  // namespace lodestone
