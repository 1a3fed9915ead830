#include "core/mapping/field_survey.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace lodestone {

std::vector<FieldCell> thin_survey(const std::vector<FieldObservation>& observations, double cell_m,
                                   const ObservationChoice& chosen) {
  using Voxel = std::array<std::int64_t, 3>;  // z, y, x
  struct VoxelHash {
    std::size_t operator()(const Voxel& voxel) const {
      std::uint64_t hash = 0;
      for (const std::int64_t index : voxel) hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9E3779B97F4A7C15ULL;
      return hash ^ (hash >> 32U);
    }
  };
  struct Entry {
    Voxel voxel;
    FieldCell cell;
  };
  // Summed in the observations' order. Memory grows with the cells, not with the readings.
  std::vector<Entry> entries;
  std::unordered_map<Voxel, std::size_t, VoxelHash> entry_of;
  for (const FieldObservation& observation : observations) {
    if (!observation.position.allFinite() || !observation.field_ut.allFinite()) continue;
    if (chosen && !chosen(observation)) continue;
    const auto index = [&](int axis) {
      return static_cast<std::int64_t>(std::floor(observation.position[axis] / cell_m));
    };
    const Voxel voxel{index(2), index(1), index(0)};
    const auto [found, added] = entry_of.try_emplace(voxel, entries.size());
    if (added) entries.push_back({voxel, {}});
    FieldCell& cell = entries[found->second].cell;
    cell.position += observation.position;
    cell.field_ut += observation.field_ut;
    cell.variance_ut2 += observation.noise_ut * observation.noise_ut;
    ++cell.count;
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.voxel < b.voxel; });
  std::vector<FieldCell> cells;
  cells.reserve(entries.size());
  for (const Entry& entry : entries) {
    FieldCell cell = entry.cell;
    cell.position /= cell.count;
    cell.field_ut /= cell.count;
    cell.variance_ut2 /= static_cast<double>(cell.count) * cell.count;
    cells.push_back(cell);
  }
  return cells;
}

HeldOutBlocks::HeldOutBlocks(const std::vector<FieldObservation>& observations, Time block, Time period)
    : block_(block), period_(period) {
  if (observations.empty()) return;
  begin_ = observations.front().time;
  for (const FieldObservation& observation : observations) begin_ = std::min(begin_, observation.time);
}

bool HeldOutBlocks::contain(const FieldObservation& observation) const {
  return (observation.time - begin_) / block_ % period_ == period_ / 2;
}

}  // namespace lodestone
