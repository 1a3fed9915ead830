#include "core/mapping/field_survey.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
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
    if (added) {
      entries.push_back({voxel, {}});
      entries.back().cell.time = observation.time;
    }
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

HeldOutBlocks::HeldOutBlocks(const std::vector<FieldObservation>& observations, double block_m, int period, int phase)
    : period_(period), phase_(phase) {
  constexpr Time moment = from_seconds(0.2);
  constexpr double step_m = 0.1;
  std::vector<const FieldObservation*> in_time;
  for (const FieldObservation& observation : observations) {
    if (observation.position.allFinite()) in_time.push_back(&observation);
  }
  std::stable_sort(in_time.begin(), in_time.end(), [](const auto* a, const auto* b) { return a->time < b->time; });
  std::optional<Vector3> last;
  double way_m = 0.0;
  for (std::size_t i = 0; i < in_time.size();) {
    const Time begin = in_time[i]->time;
    Vector3 sum = Vector3::Zero();
    const std::size_t first = i;
    for (; i < in_time.size() && in_time[i]->time - begin < moment; ++i) sum += in_time[i]->position;
    const Vector3 place = sum / static_cast<double>(i - first);
    if (!last) last = place;
    if ((place - *last).norm() >= step_m) {
      way_m += (place - *last).norm();
      last = place;
    }
    const auto block = static_cast<std::size_t>(way_m / block_m);
    while (begins_.size() <= block) begins_.push_back(begin);
  }
}

int HeldOutBlocks::block_of(Time time) const {
  const auto next = std::upper_bound(begins_.begin(), begins_.end(), time);
  return std::max(0, static_cast<int>(next - begins_.begin()) - 1);
}

}  // namespace lodestone
