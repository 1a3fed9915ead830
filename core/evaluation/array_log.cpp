#include "core/evaluation/array_log.h"

#include <algorithm>

namespace lodestone {

namespace {

float median_in_place(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5F * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace

void ArrayLog::add(std::span<const MagneticArraySample> samples) {
  std::vector<float> values;
  for (std::size_t begin = 0; begin < samples.size();) {
    std::size_t end = begin + 1;
    while (end < samples.size() && samples[end].time < samples[begin].time + span) ++end;
    const auto part = samples.subspan(begin, end - begin);
    begin = end;
    times_.push_back(part.front().time + (part.back().time - part.front().time) / 2);
    for (std::size_t j = 0; j < magnetometers_; ++j) {
      Reading reading;
      for (int axis = 0; axis < 3; ++axis) {
        values.clear();
        for (const MagneticArraySample& sample : part) {
          if (j < sample.field_ut.size() && sample.field_ut[j] && sample.field_ut[j]->allFinite()) {
            values.push_back(static_cast<float>((*sample.field_ut[j])[axis]));
          }
        }
        if (2 * values.size() < part.size() || values.empty()) break;
        reading.field_ut[axis] = median_in_place(values);
        reading.samples = static_cast<int>(values.size());
      }
      readings_.push_back(reading);
    }
  }
}

}  // namespace lodestone
