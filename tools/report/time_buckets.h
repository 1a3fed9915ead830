#pragma once

#include <cstddef>
#include <vector>

#include "core/time.h"

namespace lodestone {

/// Reduction of the values of several scans to one drawn value.
enum class Summary {
  largest,   ///< for errors and sigmas
  smallest,  ///< for weights
  last       ///< for positions
};

/// A common time axis for all series of a run: its scan ends in buckets, so that no series exceeds the limit. Extreme
/// values are kept, unlike with every n-th value.
class TimeBuckets {
 public:
  /// `stamps` strictly increasing; `limit` at least 1.
  TimeBuckets(std::vector<Time> stamps, std::size_t limit);

  std::size_t size() const { return (stamps_.size() + width_ - 1) / width_; }

  /// Scans per bucket; 1: every scan is drawn.
  std::size_t width() const { return width_; }

  /// The last stamp of every bucket.
  std::vector<Time> times() const;

  /// One value per bucket; NaN if none of its scans has a finite value. Stamps outside the axis are ignored.
  std::vector<double> summarize(const std::vector<Time>& times, const std::vector<double>& values,
                                Summary summary) const;

 private:
  std::vector<Time> stamps_;
  std::size_t width_;
};

}  // namespace lodestone
