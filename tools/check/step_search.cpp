#include "tools/check/step_search.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "core/evaluation/statistics.h"

namespace lodestone {
namespace {

constexpr double normal_sigma = 1.4826;  // standard deviation over median absolute deviation, normal distribution

/// Sigma per component from differences of neighbours, which a step hardly affects.
double spread_of(std::span<const Vector3> series) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < series.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) steps.push_back(std::abs(series[i][axis] - series[i - 1][axis]));
  }
  return normal_sigma * summarize(steps).median / std::numbers::sqrt2;
}

}  // namespace

LargestStep largest_step(std::span<const Vector3> series, std::size_t least_side) {
  LargestStep result;
  const double spread = spread_of(series);
  std::vector<Vector3> sums{Vector3::Zero()};
  for (const Vector3& value : series) sums.push_back(sums.back() + value);
  for (std::size_t i = least_side; i + least_side <= series.size(); ++i) {
    const auto before = static_cast<double>(i);
    const auto after = static_cast<double>(series.size() - i);
    const Vector3 step = (sums.back() - sums[i]) / after - sums[i] / before;
    const double sigma = spread * std::sqrt(1.0 / before + 1.0 / after);
    if (sigma > 0.0 && step.norm() / sigma > result.sigmas()) result = {step, sigma, i};
  }
  return result;
}

}  // namespace lodestone
