#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

#include "core/bit_mix.h"
#include "core/geometry/so3.h"

namespace lodestone {

/// A stream of random numbers, named by a seed, a purpose and an index. Streams are independent: each scan, rod or
/// sensor has its own numbers, whichever thread comes first. Source: Steele et al. 2014 (SplitMix64: a mixed counter).
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view purpose, std::uint64_t index = 0) : counter_(mix(seed + step)) {
    for (const char letter : purpose) counter_ = mix(counter_ ^ static_cast<unsigned char>(letter)) + step;
    counter_ = mix(counter_ ^ mix(index + step));
  }

  std::uint64_t bits() { return mix(counter_ += step); }

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Standard normal, by Box and Muller: two at once.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    const double angle = 2.0 * std::numbers::pi * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

  Vector3 normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }

 private:
  static constexpr std::uint64_t step = 0x9e3779b97f4a7c15ULL;
  std::uint64_t counter_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace lodestone
