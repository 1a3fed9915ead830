#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/so3.h"
#include "core/time.h"

namespace lodestone {

/// The median of each component; `vectors` must not be empty.
Vector3 component_medians(std::span<const Vector3> vectors);

/// The median of the lengths; 0 if `vectors` is empty.
double median_length(std::span<const Vector3> vectors);

/// Robust sigma of a component from differences of neighbours, which motion and steps hardly affect; 0 without any.
double neighbours_sigma(std::span<const Vector3> vectors);

/// A time in a series with increasing times: `share` of the way from the value at `index` to the next.
struct PlaceInSeries {
  std::size_t index;
  double share;

  Vector3 value_of(const std::vector<Vector3>& vectors) const {
    return vectors[index] + share * (vectors[index + 1] - vectors[index]);
  }
};
/// Nothing outside the series, or where neighbours are more than `longest_gap` apart.
std::optional<PlaceInSeries> place_in(const std::vector<Time>& times, Time time, Time longest_gap);

double angle_between_rad(const Vector3& a, const Vector3& b);

}  // namespace lodestone
