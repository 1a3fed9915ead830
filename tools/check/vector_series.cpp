#include "tools/check/vector_series.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/evaluation/statistics.h"

namespace lodestone {

Vector3 component_medians(std::span<const Vector3> vectors) {
  Vector3 result = Vector3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3& vector : vectors) values.push_back(vector[axis]);
    result[axis] = summarize(values).median;
  }
  return result;
}

double median_length(std::span<const Vector3> vectors) {
  std::vector<double> sizes;
  for (const Vector3& vector : vectors) sizes.push_back(vector.norm());
  return summarize(sizes).median;
}

double neighbours_sigma(std::span<const Vector3> vectors) {
  constexpr double kNormalSigma = 1.4826;  // standard deviation over median absolute deviation, normal distribution
  std::vector<double> steps;
  for (std::size_t i = 1; i < vectors.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) steps.push_back(std::abs(vectors[i][axis] - vectors[i - 1][axis]));
  }
  return kNormalSigma * summarize(steps).median / std::numbers::sqrt2;
}

std::optional<PlaceInSeries> place_in(const std::vector<Time>& times, Time time, Time longest_gap) {
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  if (after == times.begin() || after == times.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - times.begin()) - 1;
  if (times[i + 1] - times[i] > longest_gap) return std::nullopt;
  return PlaceInSeries{i, to_seconds(time - times[i]) / to_seconds(times[i + 1] - times[i])};
}

double angle_between_rad(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace lodestone
