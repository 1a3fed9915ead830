#include "core/imu/white_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lodestone {

namespace {

constexpr long kFewest = 40;
constexpr double kBinsAnOctave = 8.0;
constexpr double kOverWhiteNoise = 10.0;
/// A platform file states too little by a factor of up to three (grade `rough`). What exceeds it is vibration, which is
/// not white.
constexpr double kUnderstated = 3.0;
/// The found density has the resolution of its bins and the error of a median.
constexpr double kFoundLow = 0.9;
constexpr double kApart_s = 0.005;
/// Of a sample's largest component: samples are often rounded to floats. Interpolated samples lie on a line up to it.
constexpr double kRounding = 1e-6;

}  // namespace

void ImuWhiteNoise::Magnitudes::add(double value, double rounding) {
  ++total_;
  if (value > rounding && std::isfinite(value)) {
    ++counts_[static_cast<int>(std::floor(kBinsAnOctave * std::log2(value)))];
  } else {
    ++zeros_;
  }
}

double ImuWhiteNoise::Magnitudes::median() const {
  if (total_ < kFewest || 2 * zeros_ >= total_) return 0.0;
  long below = zeros_;
  for (const auto& [bin, count] : counts_) {
    below += count;
    if (2 * below >= total_) return std::exp2((bin + 0.5) / kBinsAnOctave);
  }
  return 0.0;
}

void ImuWhiteNoise::Differences::add(std::span<const ImuSample> samples, std::size_t stride) {
  for (std::size_t i = 1; i + 3 * stride + 1 < samples.size(); ++i) {
    const std::array<const ImuSample*, 4> four{&samples[i], &samples[i + stride], &samples[i + 2 * stride],
                                               &samples[i + 3 * stride]};
    const Time first = four[1]->time - four[0]->time;
    const Time second = four[2]->time - four[1]->time;
    const Time third = four[3]->time - four[2]->time;
    const auto [least, most] = std::minmax({first, second, third});
    if (least <= 0 || most > 2 * least) continue;
    const auto add_to = [&](Magnitudes& magnitudes, auto member) {
      const Vector3 difference =
          four[3]->*member - 3.0 * (four[2]->*member) + 3.0 * (four[1]->*member) - four[0]->*member;
      const double rounding = kRounding * (four[0]->*member).cwiseAbs().maxCoeff();
      for (int axis = 0; axis < 3; ++axis) magnitudes.add(std::abs(difference[axis]), rounding);
    };
    add_to(gyroscope, &ImuSample::angular_velocity);
    add_to(accelerometer, &ImuSample::linear_acceleration);
    step_sum_s += to_seconds(first);
    ++steps;
  }
}

double ImuWhiteNoise::Differences::density(const Magnitudes& magnitudes) const {
  if (steps == 0) return 0.0;
  // Third differences of white noise have twenty times its variance. The factor 1.4826 converts a median to a standard
  // deviation.
  return 1.4826 / std::sqrt(20.0) * std::sqrt(step_sum_s / static_cast<double>(steps)) * magnitudes.median();
}

void ImuWhiteNoise::add(std::span<const ImuSample> samples) {
  neighbours_.add(samples, 1);
  if (samples.size() < 2) return;
  const double period_s =
      to_seconds(samples.back().time - samples.front().time) / static_cast<double>(samples.size() - 1);
  const double stride = std::floor(kApart_s / period_s + 1e-3);
  // A stride of one, or nonsense: the neighbours.
  const bool is_fast = stride > 1.0 && stride < static_cast<double>(samples.size());
  apart_.add(samples, is_fast ? static_cast<std::size_t>(stride) : 1);
}

ImuNoise ImuWhiteNoise::bound(const ImuNoise& stated) const {
  const auto bounded = [](double density, double found, double found_apart) {
    double result = density;
    if (found_apart > 0.0) result = std::min(result, kOverWhiteNoise * std::max(found, found_apart));
    return std::max(result, std::min(kFoundLow * found, kUnderstated * density));
  };
  ImuNoise result = stated;
  result.gyroscope_noise_density = bounded(stated.gyroscope_noise_density, neighbours_.density(neighbours_.gyroscope),
                                           apart_.density(apart_.gyroscope));
  result.accelerometer_noise_density =
      bounded(stated.accelerometer_noise_density, neighbours_.density(neighbours_.accelerometer),
              apart_.density(apart_.accelerometer));
  return result;
}

}  // namespace lodestone
