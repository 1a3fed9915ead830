#pragma once

#include <cstddef>
#include <vector>

namespace lodestone {

/// Summary of errors, in their unit.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double standard_deviation = 0.0;  ///< about the mean, divided by the count
  double min = 0.0;
  double max = 0.0;
};

/// All values are zero if there are no errors.
ErrorStatistics summarize(const std::vector<double>& errors);

/// The empirical distribution function of errors.
class ErrorDistribution {
 public:
  explicit ErrorDistribution(std::vector<double> errors);

  /// The share of errors at most `threshold`, 0 to 1.
  double share_within(double threshold) const;

  /// The smallest error that a share of at least `share` (0 to 1) does not exceed. Throws std::invalid_argument if
  /// there are no errors or `share` is out of range.
  double quantile(double share) const;

  /// The errors in ascending order: the distribution reaches (i + 1) / size at the i-th.
  const std::vector<double>& sorted() const { return sorted_; }

 private:
  std::vector<double> sorted_;
};

}  // namespace lodestone
