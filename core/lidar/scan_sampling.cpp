#include "core/lidar/scan_sampling.h"

#include <algorithm>
#include <cstdint>
#include <unordered_map>

#include "core/bit_mix.h"
#include "core/lidar/range_limits.h"
#include "core/lidar/voxel_planes.h"

namespace lodestone {

namespace {

constexpr std::uint64_t kEmptySlot = ~std::uint64_t{0};

/// Number of points in each voxel of a scan.
class VoxelCounts {
 public:
  VoxelCounts(std::size_t points, double voxel_m) : inverse_voxel_(static_cast<float>(1.0 / voxel_m)) {
    std::size_t capacity = 1024;
    while (capacity < 2 * points) capacity *= 2;
    slots_.assign(capacity, {kEmptySlot, 0, 0});
  }

  /// Adds a point; returns its voxel's slot.
  std::size_t add(const Eigen::Vector3f& point) {
    const std::uint64_t key = voxel_key(voxel_of(point, inverse_voxel_));
    const std::size_t slot = find(key);
    slots_[slot].key = key;
    ++slots_[slot].count;
    return slot;
  }

  /// Sums the counts of the 3 × 3 × 3 voxels around each voxel. Each pair of voxels is looked up once, for both.
  void sum_surroundings() {
    for (Slot& slot : slots_) {
      if (slot.key == kEmptySlot) continue;
      slot.surroundings += slot.count;
      const Eigen::Vector3i centre = voxel_of_key(slot.key);
      constexpr int kOffsets = 27;
      for (int offset = kOffsets / 2 + 1; offset < kOffsets; ++offset) {
        const Eigen::Vector3i step(offset / 9 - 1, offset / 3 % 3 - 1, offset % 3 - 1);
        Slot& other = slots_[find(voxel_key(centre + step))];
        if (other.key == kEmptySlot) continue;
        slot.surroundings += other.count;
        other.surroundings += slot.count;
      }
    }
  }

  int surroundings(std::size_t slot) const { return slots_[slot].surroundings; }

 private:
  struct Slot {
    std::uint64_t key;
    int count;
    int surroundings;
  };

  std::size_t find(std::uint64_t key) const {
    std::size_t slot = mix(key) & (slots_.size() - 1);
    while (slots_[slot].key != kEmptySlot && slots_[slot].key != key) slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }

  float inverse_voxel_;
  std::vector<Slot> slots_;
};

/// Draws from a sequence of points with given probabilities: one point from every stretch whose probabilities sum to
/// one, at a random place within the stretch. The draw never resonates with the scan pattern.
class StratifiedDraw {
 public:
  explicit StratifiedDraw(std::uint64_t seed) : seed_(seed), next_(place()) {}

  bool take(double probability) {
    sum_ += probability;
    if (sum_ < next_) return false;
    ++stratum_;
    next_ = place();
    return true;
  }

 private:
  double place() const {
    return static_cast<double>(stratum_) + static_cast<double>(mix(seed_ << 32 | stratum_) >> 11) * 0x1.0p-53;
  }

  std::uint64_t seed_;
  std::uint64_t stratum_ = 0;
  double sum_ = 0.0;
  double next_;
};

}  // namespace

std::vector<LidarPoint> sample_scan(const LidarScan& scan, std::span<const LidarModel> lidars,
                                    const ScanSamplingOptions& options) {
  const std::vector<RangeLimits> limits = range_limits_of(lidars);
  std::vector<LidarPoint> kept;
  kept.reserve(scan.points.size());
  for (const LidarPoint& point : scan.points) {
    if (limits.at(point.lidar).hold(point)) kept.push_back(point);
  }
  if (options.voxel_m > 0.0) {
    constexpr double kVoxelsOfASurface = 9.0;  // of the 27
    VoxelCounts counts(kept.size(), options.voxel_m);
    std::vector<std::size_t> slots;
    slots.reserve(kept.size());
    for (const LidarPoint& point : kept) slots.push_back(counts.add(point.position));
    counts.sum_surroundings();
    std::unordered_map<int, StratifiedDraw> rings;
    std::size_t size = 0;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const int ring = kept[i].lidar << 16 | kept[i].ring;
      const double probability = std::min(1.0, kVoxelsOfASurface / counts.surroundings(slots[i]));
      if (rings.try_emplace(ring, static_cast<std::uint64_t>(ring) + 1).first->second.take(probability))
        kept[size++] = kept[i];
    }
    kept.resize(size);
  }
  const std::size_t limit = static_cast<std::size_t>(options.max_points);
  if (options.max_points > 0 && kept.size() > limit) {
    for (std::size_t i = 0; i < limit; ++i) kept[i] = kept[i * kept.size() / limit];
    kept.resize(limit);
  }
  kept.shrink_to_fit();  // a batch keeps the points of every scan
  return kept;
}

}  // namespace lodestone
