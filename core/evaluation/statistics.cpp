#include "core/evaluation/statistics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace lodestone {

ErrorStatistics summarize(const std::vector<double>& errors) {
  ErrorStatistics result;
  if (errors.empty()) return result;
  result.count = errors.size();
  const double count = static_cast<double>(errors.size());
  double square_sum = 0.0;
  for (const double error : errors) {
    result.mean += error / count;
    square_sum += error * error;
  }
  result.rmse = std::sqrt(square_sum / count);
  double deviation_sum = 0.0;
  for (const double error : errors) deviation_sum += (error - result.mean) * (error - result.mean);
  result.standard_deviation = std::sqrt(deviation_sum / count);

  std::vector<double> sorted = errors;
  std::sort(sorted.begin(), sorted.end());
  result.min = sorted.front();
  result.max = sorted.back();
  const std::size_t middle = sorted.size() / 2;
  result.median = sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
  return result;
}

ErrorDistribution::ErrorDistribution(std::vector<double> errors) : sorted_(std::move(errors)) {
  std::sort(sorted_.begin(), sorted_.end());
}

double ErrorDistribution::share_within(double threshold) const {
  if (sorted_.empty()) return 0.0;
  const auto above = std::upper_bound(sorted_.begin(), sorted_.end(), threshold);
  return static_cast<double>(above - sorted_.begin()) / static_cast<double>(sorted_.size());
}

double ErrorDistribution::quantile(double share) const {
  if (sorted_.empty() || !(share >= 0.0 && share <= 1.0)) {
    throw std::invalid_argument("quantile: expected a share between 0 and 1, and at least one error");
  }
  const double rank = std::ceil(share * static_cast<double>(sorted_.size()));
  return sorted_[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

}  // namespace lodestone
