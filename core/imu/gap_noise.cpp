#include "core/imu/gap_noise.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

// Rates of a robot that drives, turns or is carried, by five logs: docs/design/062-gaps-of-the-imu.md.
constexpr double kAngularVelocity_rad_s = 0.5;
constexpr double kAcceleration_m_s2 = 1.0;
constexpr double kCorrelation_s = 1.0;
constexpr double kLongest_s = 2.0;

/// Variance a second that the integral of a first-order Gauss-Markov process of unit variance has beside the mean of
/// its two end values.
double variance_a_second(double gap_s) {
  const double x = gap_s / kCorrelation_s;
  const double e = std::exp(-x);
  return kCorrelation_s * (2.0 * (x - 1.0 + e) + 0.5 * x * x * (1.0 + e) - 2.0 * x * (1.0 - e)) / x;
}

}  // namespace

ImuNoise with_gap(const ImuNoise& noise, double gap_s) {
  if (!(gap_s * noise.rate_hz > kImuGapPeriods)) return noise;
  const double root = std::sqrt(variance_a_second(std::min(gap_s, kLongest_s)));
  ImuNoise result = noise;
  result.gyroscope_noise_density = std::hypot(noise.gyroscope_noise_density, kAngularVelocity_rad_s * root);
  result.accelerometer_noise_density = std::hypot(noise.accelerometer_noise_density, kAcceleration_m_s2 * root);
  return result;
}

}  // namespace lodestone
