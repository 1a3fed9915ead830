#include "tools/plotting/window_statistics.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace lodestone::figures {

WindowStatistics window_statistics(const std::vector<double>& time_s, const std::vector<double>& values,
                                   double window_s) {
  if (time_s.size() != values.size()) throw std::invalid_argument("window_statistics: expected one value per time");
  if (!(window_s > 0.0)) throw std::invalid_argument("window_statistics: expected a window above 0");
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr double kRounding = 1e-9;  // tolerance for rounding of stamps that are one window apart
  const double half = 0.5 * window_s + kRounding;
  WindowStatistics result;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double time = time_s[i];
    if (i > 0 && !(time >= time_s[i - 1])) throw std::invalid_argument("window_statistics: expected increasing times");
    if (i > 0 && time - time_s[i - 1] > window_s + kRounding) {
      result.time_s.push_back(0.5 * (time + time_s[i - 1]));
      result.mean.push_back(kNone);
      result.standard_deviation.push_back(kNone);
    }
    while (time_s[begin] < time - half) ++begin;
    double sum = 0.0;
    std::size_t count = 0;
    std::size_t end = begin;
    for (; end < time_s.size() && time_s[end] <= time + half; ++end) {
      if (!std::isfinite(values[end])) continue;
      sum += values[end];
      ++count;
    }
    const double mean = count > 0 ? sum / static_cast<double>(count) : kNone;
    double squares = 0.0;
    for (std::size_t k = begin; k < end; ++k) {
      if (std::isfinite(values[k])) squares += (values[k] - mean) * (values[k] - mean);
    }
    result.time_s.push_back(time);
    result.mean.push_back(mean);
    result.standard_deviation.push_back(count > 0 ? std::sqrt(squares / static_cast<double>(count)) : kNone);
  }
  return result;
}

}  // namespace lodestone::figures
