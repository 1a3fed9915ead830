#pragma once

#include <cstddef>
#include <map>
#include <span>

#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The white noise in the samples of an IMU: the median of their third differences, to which motion contributes little.
/// This bounds the noise that a platform file states. With a density far above the noise, the velocity would be free,
/// and each scan would be deskewed by its own errors. With a density below it, the covariance would be too small
/// (docs/design/038-noise-of-the-imu.md).
///
/// Low-pass filters and interpolation hide noise from neighbouring samples. The upper bound is therefore by samples
/// 5 ms apart, as those of an IMU at 200 Hz.
class ImuWhiteNoise {
 public:
  /// Samples of one scan, in order. The first and the last are ignored: they may be interpolated.
  void add(std::span<const ImuSample> samples);

  /// `stated`, with densities of at most ten times those of the samples: a low-pass filter at a fifth of the rate hides
  /// nine tenths of the noise from third differences. Densities below those of the samples are raised to 0.9 of them,
  /// at most to three times the statement. Unchanged if there are too few samples, or if they are quantized or mostly
  /// interpolated.
  ImuNoise bound(const ImuNoise& stated) const;

 private:
  /// A median in constant memory: counts by eighths of an octave.
  class Magnitudes {
   public:
    void add(double value, double rounding);  ///< below `rounding`, a value counts as zero
    double median() const;                    ///< 0: fewer than forty values, or most of them zero

   private:
    std::map<int, long> counts_;
    long zeros_ = 0;
    long total_ = 0;
  };

  /// Third differences of samples that are `stride` samples apart.
  struct Differences {
    Magnitudes gyroscope;      // rad/s
    Magnitudes accelerometer;  // m/s²
    double step_sum_s = 0.0;
    long steps = 0;

    void add(std::span<const ImuSample> samples, std::size_t stride);
    double density(const Magnitudes& magnitudes) const;  // 0: unknown
  };

  Differences neighbours_;
  Differences apart_;
};

}  // namespace lodestone
