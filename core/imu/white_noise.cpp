#include "core/imu/white_noise.h"

#include <algorithm>
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

}  // namespace

void ImuWhiteNoise::Magnitudes::add(double value) {
  ++total_;
  if (value > 0.0 && std::isfinite(value)) {
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

void ImuWhiteNoise::add(std::span<const ImuSample> samples) {
  for (std::size_t i = 1; i + 4 < samples.size(); ++i) {
    const Time first = samples[i + 1].time - samples[i].time;
    const Time second = samples[i + 2].time - samples[i + 1].time;
    const Time third = samples[i + 3].time - samples[i + 2].time;
    const auto [least, most] = std::minmax({first, second, third});
    if (least <= 0 || most > 2 * least) continue;
    const auto difference = [&](auto member) -> Vector3 {
      return samples[i + 3].*member - 3.0 * samples[i + 2].*member + 3.0 * samples[i + 1].*member - samples[i].*member;
    };
    const Vector3 turn = difference(&ImuSample::angular_velocity);
    const Vector3 force = difference(&ImuSample::linear_acceleration);
    for (int axis = 0; axis < 3; ++axis) {
      gyroscope_.add(std::abs(turn[axis]));
      accelerometer_.add(std::abs(force[axis]));
    }
    step_sum_s_ += to_seconds(first);
    ++steps_;
  }
}

ImuNoise ImuWhiteNoise::bound(const ImuNoise& stated) const {
  ImuNoise result = stated;
  if (steps_ == 0) return result;
  // Third differences of white noise have twenty times its variance. The factor 1.4826 converts a median to a standard
  // deviation.
  const double to_density = 1.4826 / std::sqrt(20.0) * std::sqrt(step_sum_s_ / static_cast<double>(steps_));
  const auto bounded = [&](double density, const Magnitudes& magnitudes) {
    const double found = magnitudes.median() * to_density;
    if (!(found > 0.0)) return density;
    const double least = std::min(kFoundLow * found, kUnderstated * density);
    return std::clamp(density, least, kOverWhiteNoise * found);
  };
  result.gyroscope_noise_density = bounded(stated.gyroscope_noise_density, gyroscope_);
  result.accelerometer_noise_density = bounded(stated.accelerometer_noise_density, accelerometer_);
  return result;
}

}  // namespace lodestone
