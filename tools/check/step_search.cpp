#include "tools/check/step_search.h"

#include <cmath>
#include <vector>

#include "tools/check/vector_series.h"

namespace lodestone {
LargestStep largest_step(std::span<const Vector3> series, std::size_t least_side) {
  LargestStep result;
  const double spread = neighbours_sigma(series);
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
