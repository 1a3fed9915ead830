#pragma once

#include <vector>

namespace lodestone::figures {

/// Moving mean and standard deviation.
struct WindowStatistics {
  std::vector<double> time_s;
  std::vector<double> mean;                ///< NaN between values more than a window apart; interrupts a curve
  std::vector<double> standard_deviation;  ///< about the window's mean, divided by the count
};

/// For every time t, the mean and standard deviation of the finite values in [t − window/2, t + window/2]. `time_s`
/// must increase. Throws std::invalid_argument if sizes differ, times decrease, or the window is not positive.
WindowStatistics window_statistics(const std::vector<double>& time_s, const std::vector<double>& values,
                                   double window_s);

}  // namespace lodestone::figures
