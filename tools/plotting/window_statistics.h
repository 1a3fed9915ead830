#pragma once

#include <vector>

namespace lodestone::figures {

/// A moving mean and what the values spread about it within its window.
struct WindowStatistics {
  std::vector<double> time_s;
  std::vector<double> mean;  ///< NaN between values that are more than a window apart: a curve breaks there
  std::vector<double> standard_deviation;  ///< about the window's mean, divided by the count
};

/// At every time t the mean and standard deviation of the finite values in [t − window/2, t + window/2]. `time_s`
/// rises. Throws std::invalid_argument where sizes differ, times fall, or the window is not above 0.
WindowStatistics window_statistics(const std::vector<double>& time_s, const std::vector<double>& values,
                                   double window_s);

}  // namespace lodestone::figures
