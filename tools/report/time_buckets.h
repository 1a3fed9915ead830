#pragma once

#include <cstddef>
#include <vector>

#include "core/time.h"

namespace lodestone {

/// How the values of several scans become the one that is drawn.
enum class Summary {
  largest,   ///< for what is bad when large: errors, sigmas
  smallest,  ///< for what is bad when small: weights
  last       ///< for positions
};

/// One time axis for every series of a run: its scan ends, so many to a bucket that no series is longer than wanted.
/// Extremes survive, which a plain every-nth would lose.
class TimeBuckets {
 public:
  /// `stamps` in rising order without doubles; `limit` at least 1.
  TimeBuckets(std::vector<Time> stamps, std::size_t limit);

  std::size_t size() const { return (stamps_.size() + width_ - 1) / width_; }

  /// Scans to a bucket; 1: every scan is drawn as it is.
  std::size_t width() const { return width_; }

  /// The last stamp of every bucket.
  std::vector<Time> times() const;

  /// One value a bucket; NaN where none of its scans has a value that is a number. Stamps that are not on the axis are
  /// left out.
  std::vector<double> summarize(const std::vector<Time>& times, const std::vector<double>& values,
                                Summary summary) const;

 private:
  std::vector<Time> stamps_;
  std::size_t width_;
};

}  // namespace lodestone
