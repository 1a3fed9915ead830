#include "core/mapping/field_survey.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace lodestone {

std::vector<FieldCell> thin_survey(const std::vector<FieldObservation>& observations, double cell_m) {
  struct Entry {
    std::array<std::int64_t, 3> voxel;  // z, y, x
    std::size_t index;
    bool operator<(const Entry& other) const {
      return voxel != other.voxel ? voxel < other.voxel : index < other.index;
    }
  };
  std::vector<Entry> entries;
  entries.reserve(observations.size());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const FieldObservation& observation = observations[i];
    if (!observation.position.allFinite() || !observation.field_ut.allFinite()) continue;
    const auto voxel = [&](int axis) { return static_cast<std::int64_t>(std::floor(observation.position[axis] / cell_m)); };
    entries.push_back({{voxel(2), voxel(1), voxel(0)}, i});
  }
  std::sort(entries.begin(), entries.end());

  std::vector<FieldCell> cells;
  for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    FieldCell cell;
    for (end = begin; end < entries.size() && entries[end].voxel == entries[begin].voxel; ++end) {
      const FieldObservation& observation = observations[entries[end].index];
      cell.position += observation.position;
      cell.field_ut += observation.field_ut;
      cell.variance_ut2 += observation.noise_ut * observation.noise_ut;
      ++cell.count;
    }
    cell.position /= cell.count;
    cell.field_ut /= cell.count;
    cell.variance_ut2 /= static_cast<double>(cell.count) * cell.count;
    cells.push_back(cell);
  }
  return cells;
}

SurveySplit split_survey(const std::vector<FieldObservation>& observations, Time block, Time period) {
  SurveySplit split;
  if (observations.empty()) return split;
  Time begin = observations.front().time;
  for (const FieldObservation& observation : observations) begin = std::min(begin, observation.time);
  for (const FieldObservation& observation : observations) {
    const bool out = (observation.time - begin) / block % period == period / 2;
    (out ? split.held_out : split.training).push_back(observation);
  }
  return split;
}

}  // namespace lodestone
