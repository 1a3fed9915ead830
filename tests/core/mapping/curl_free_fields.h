#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "core/mapping/curl_free_kernel.h"

namespace lodestone::testing {

/// A draw of a curl-free field with the kernel of a CurlFreeKernel, by random Fourier features: 600 plane waves of the
/// potential. b is zero.
class RandomPotential {
 public:
  RandomPotential(const CurlFreeKernel& kernel, std::uint64_t seed) : mean_(kernel.mean_ut) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    amplitude_ = kernel.signal_sigma_ut * kernel.length_scale_m * std::sqrt(2.0 / 600.0);
    for (int i = 0; i < 600; ++i) {
      const Vector3 wave(normal(generator), normal(generator), normal(generator));
      frequencies_.push_back(wave.cwiseQuotient(kernel.length_scales_m()));
      phases_.push_back(2.0 * M_PI * static_cast<double>(generator() >> 11) * 0x1.0p-53);
    }
  }
  Vector3 operator()(const Vector3& point) const {
    Vector3 field = mean_;
    for (std::size_t i = 0; i < phases_.size(); ++i) {
      field += amplitude_ * std::sin(frequencies_[i].dot(point) + phases_[i]) * frequencies_[i];
    }
    return field;
  }

 private:
  Vector3 mean_;
  double amplitude_ = 0.0;
  std::vector<Vector3> frequencies_;
  std::vector<double> phases_;
};

/// Lanes along x at 0.4 m height, `spacing` apart, a reading every 1.25 cm; stamps are continuous.
template <class Field>
std::vector<FieldObservation> survey_lanes(const Field& field, double length, int lanes, double spacing, double noise,
                                           std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<FieldObservation> observations;
  for (int lane = 0; lane < lanes; ++lane) {
    for (double x = 0.0; x < length; x += 0.0125) {
      FieldObservation observation;
      observation.position = Vector3(x, spacing * lane + 0.02 * std::sin(x), 0.4);
      observation.field_ut =
          field(observation.position) + noise * Vector3(normal(generator), normal(generator), normal(generator));
      observation.noise_ut = noise;
      observation.time = static_cast<Time>(observations.size()) * 10'000'000;
      observations.push_back(observation);
    }
  }
  return observations;
}

}  // namespace lodestone::testing
