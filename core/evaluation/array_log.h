#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.h"

namespace lodestone {

/// The magnetometers' readings of a whole log, thinned: the median of each component over `span` of time. The median
/// rejects spikes. An hour of eight magnetometers needs some ten megabytes.
class ArrayLog {
 public:
  struct Reading {
    Eigen::Vector3f field_ut = Eigen::Vector3f::Zero();  ///< magnetometer axes
    int samples = 0;                                     ///< number of samples in the median; 0: no reading
  };

  /// Variance of the median over the variance of the mean, for normal samples: π/2.
  static constexpr double median_variance = 1.5708;
  static constexpr Time span = from_seconds(0.05);

  explicit ArrayLog(std::size_t magnetometers) : magnetometers_(magnetometers) {}

  /// The samples of one bundle, in order of time. If more than half of a span's samples are missing, the magnetometer
  /// has no reading for that span: its median would belong to another time.
  void add(std::span<const MagneticArraySample> samples);

  std::size_t size() const { return times_.size(); }
  std::size_t magnetometers() const { return magnetometers_; }
  Time time(std::size_t index) const { return times_[index]; }  ///< mean of the first and last sample's time
  const Reading& reading(std::size_t index, std::size_t magnetometer) const {
    return readings_[index * magnetometers_ + magnetometer];
  }

 private:
  std::size_t magnetometers_;
  std::vector<Time> times_;
  std::vector<Reading> readings_;
};

}  // namespace lodestone
