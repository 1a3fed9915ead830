#include "tools/plotting/error_scale.h"

#include <algorithm>
#include <cmath>

#include "core/middle_value.h"

namespace lodestone::figures {

namespace {

constexpr double kWorst_m = 100.0;
constexpr double kBest_m = 1e-4;

/// The largest value of 1, 2, 5 · 10ⁿ at or below `value`; the smallest at or above it.
double round_down(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value) + 1e-12));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= value * (1.0 + 1e-9)) return digit * power;
  }
  return power;
}

double round_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value) + 1e-12));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= value * (1.0 - 1e-9)) return digit * power;
  }
  return 10.0 * power;
}

struct Spread {
  double low = 0.0;  ///< the smallest 2 % quantile of all methods
  double smallest_median = 0.0;
  double high = 0.0;  ///< the largest error; 0 without errors
};

Spread spread_of(const std::vector<std::vector<double>>& errors) {
  Spread spread;
  for (std::vector<double> values : errors) {
    values.erase(std::remove_if(values.begin(), values.end(), [](double value) { return !std::isfinite(value); }),
                 values.end());
    if (values.empty()) continue;
    const double low = value_at_share(values, 0.02);
    const double median = value_at_share(values, 0.5);
    const bool first = spread.high == 0.0;
    spread.low = first ? low : std::min(spread.low, low);
    spread.smallest_median = first ? median : std::min(spread.smallest_median, median);
    spread.high = std::max(spread.high, value_at_share(values, 1.0));
  }
  return spread;
}

Scale logarithmic(const Spread& spread) {
  const double high = round_up(std::clamp(spread.high, 10.0 * kBest_m, kWorst_m));
  return {round_down(std::clamp(spread.low, kBest_m, 0.1 * high)), high, true};
}

}  // namespace

Scale error_scale(const std::vector<std::vector<double>>& errors_m) {
  const Spread spread = spread_of(errors_m);
  if (!(spread.high > 0.0)) return {0.0, 1.0};
  if (spread.high < 15.0 * spread.smallest_median) return {0.0, std::min(kWorst_m, round_up(1.02 * spread.high))};
  return logarithmic(spread);
}

Scale logarithmic_error_scale(const std::vector<std::vector<double>>& errors_m) {
  const Spread spread = spread_of(errors_m);
  return spread.high > 0.0 ? logarithmic(spread) : Scale{0.01, 1.0, true};
}

}  // namespace lodestone::figures
