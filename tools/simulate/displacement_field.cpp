#include "tools/simulate/displacement_field.h"

#include <cmath>

#include "core/random_stream.h"

namespace lodestone::simulation {
namespace {

constexpr int wave_count = 64;  // enough for values that are nearly Gaussian

}  // namespace

DisplacementField::DisplacementField(double rms_m, double length_m, std::uint64_t seed, std::string_view purpose) {
  if (!(rms_m > 0.0)) return;
  RandomStream random(seed, purpose);
  const double amplitude = rms_m / std::sqrt(static_cast<double>(wave_count));
  for (int i = 0; i < wave_count; ++i) {
    Wave wave;
    // The spectral density of the squared-exponential kernel is normal, with standard deviation 1 / length per axis.
    wave.wave = random.normal3() / length_m;
    wave.amplitude_cos = amplitude * random.normal3();
    wave.amplitude_sin = amplitude * random.normal3();
    waves_.push_back(wave);
  }
}

Vector3 DisplacementField::at(const Vector3& point) const {
  Vector3 sum = Vector3::Zero();
  for (const Wave& wave : waves_) {
    const double phase = wave.wave.dot(point);
    sum += std::cos(phase) * wave.amplitude_cos + std::sin(phase) * wave.amplitude_sin;
  }
  return sum;
}

Matrix3 DisplacementField::gradient(const Vector3& point) const {
  Matrix3 sum = Matrix3::Zero();
  for (const Wave& wave : waves_) {
    const double phase = wave.wave.dot(point);
    const Vector3 slope = std::cos(phase) * wave.amplitude_sin - std::sin(phase) * wave.amplitude_cos;
    sum += slope * wave.wave.transpose();
  }
  return sum;
}

Pose DisplacementField::displaced(const Pose& pose) const {
  if (empty()) return pose;
  const Matrix3 slope = gradient(pose.position);
  const Vector3 curl(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1));
  return {(so3::exp(0.5 * curl) * pose.rotation).normalized(), pose.position + at(pose.position)};
}

}  // namespace lodestone::simulation
