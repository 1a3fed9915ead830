#include "tools/report/time_buckets.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

double combine(double before, double value, Summary summary) {
  if (std::isnan(before)) return value;
  if (std::isnan(value)) return before;
  switch (summary) {
    case Summary::largest:
      return std::max(before, value);
    case Summary::smallest:
      return std::min(before, value);
    case Summary::last:
      return value;
  }
  return value;
}

}  // namespace

TimeBuckets::TimeBuckets(std::vector<Time> stamps, std::size_t limit)
    : stamps_(std::move(stamps)), width_(std::max<std::size_t>(1, (stamps_.size() + limit - 1) / limit)) {}

std::vector<Time> TimeBuckets::times() const {
  std::vector<Time> result;
  for (std::size_t i = 0; i < stamps_.size(); i += width_)
    result.push_back(stamps_[std::min(i + width_, stamps_.size()) - 1]);
  return result;
}

std::vector<double> TimeBuckets::summarize(const std::vector<Time>& times, const std::vector<double>& values,
                                           Summary summary) const {
  std::vector<double> result(size(), std::nan(""));
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto found = std::lower_bound(stamps_.begin(), stamps_.end(), times[i]);
    if (found == stamps_.end() || *found != times[i]) continue;
    double& bucket = result[static_cast<std::size_t>(found - stamps_.begin()) / width_];
    bucket = combine(bucket, values[i], summary);
  }
  return result;
}

}  // namespace lodestone
