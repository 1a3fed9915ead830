#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.h"

namespace lodestone {

/// The magnetometers' readings of a whole log, thinned so that an hour of eight magnetometers takes some ten megabytes:
/// the median of each component over `span` of time. A median, so that a spike leaves no trace.
class ArrayLog {
 public:
  struct Reading {
    Eigen::Vector3f field_ut = Eigen::Vector3f::Zero();  ///< magnetometer axes
    int samples = 0;                                     ///< that the median is of; 0: none was there
  };

  /// How much larger the variance of a median is than that of a mean of so many normal samples.
  static constexpr double median_variance = 1.5708;
  static constexpr Time span = from_seconds(0.05);

  explicit ArrayLog(std::size_t magnetometers) : magnetometers_(magnetometers) {}

  /// The samples of one bundle, in order of time. A magnetometer that misses more than half of a span's samples has no
  /// reading there: its median would belong to another time.
  void add(std::span<const MagneticArraySample> samples);

  std::size_t size() const { return times_.size(); }
  std::size_t magnetometers() const { return magnetometers_; }
  Time time(std::size_t index) const { return times_[index]; }  ///< the middle of its samples
  const Reading& reading(std::size_t index, std::size_t magnetometer) const {
    return readings_[index * magnetometers_ + magnetometer];
  }

 private:
  std::size_t magnetometers_;
  std::vector<Time> times_;
  std::vector<Reading> readings_;
};

}  // namespace lodestone
