#include "tools/check/vector_medians.h"

#include <vector>

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

}  // namespace lodestone
