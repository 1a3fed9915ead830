#pragma once

#include <map>
#include <span>

#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The white noise that the samples of an IMU show: the median of their third differences, which motion hardly
/// contributes to. It bounds what a platform file may state. A stated density far above the noise would leave the
/// velocity free, and each scan would then be deskewed by its own errors.
class ImuWhiteNoise {
 public:
  /// Samples of one scan, in order. The first and the last are left out: these may be interpolated.
  void add(std::span<const ImuSample> samples);

  /// `stated` with densities of at most ten times those of the samples: a low-pass filter at a fifth of the rate hides
  /// nine tenths of the noise from third differences. As stated where too few samples are known, or where they are
  /// quantized.
  ImuNoise bound(const ImuNoise& stated) const;

 private:
  /// A median in memory that does not grow: counts by eighths of an octave.
  class Magnitudes {
   public:
    void add(double value);
    double median() const;  ///< 0: fewer than forty values, or most of them zero

   private:
    std::map<int, long> counts_;
    long zeros_ = 0;
    long total_ = 0;
  };

  Magnitudes gyroscope_;      // rad/s
  Magnitudes accelerometer_;  // m/s²
  double step_sum_s_ = 0.0;
  long steps_ = 0;
};

}  // namespace lodestone
