#include "core/maps/plane_map.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace lodestone {

namespace {

constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
constexpr std::int32_t kNoPlane = -1;
constexpr int kKeyBits = 21;
constexpr int kKeyOffset = 1 << (kKeyBits - 1);

std::uint64_t make_key(const Eigen::Vector3i& voxel) {
  const auto part = [](int value) { return static_cast<std::uint64_t>(value + kKeyOffset) & ((1U << kKeyBits) - 1U); };
  return part(voxel.x()) << (2 * kKeyBits) | part(voxel.y()) << kKeyBits | part(voxel.z());
}

std::uint64_t spread(std::uint64_t key) {
  key *= 0x9E3779B97F4A7C15ULL;
  return key ^ (key >> 29);
}

Eigen::Vector3i voxel_of(const Eigen::Vector3f& point, float inverse_voxel) {
  return (point * inverse_voxel).array().floor().cast<int>();
}

/// A point as a member of a voxel: its own one, or one that it lies just outside of.
struct Entry {
  std::uint64_t key;
  std::uint32_t index;
  bool operator<(const Entry& other) const { return key != other.key ? key < other.key : index < other.index; }
};

/// The voxels whose box, grown by `margin` (in voxels, below one half), holds the point.
void append_memberships(const Eigen::Vector3f& scaled, float margin, std::uint32_t index, std::vector<Entry>& entries) {
  const Eigen::Vector3i low = (scaled.array() - margin).floor().cast<int>();
  const Eigen::Vector3i high = (scaled.array() + margin).floor().cast<int>();
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) entries.push_back({make_key({x, y, z}), index});
    }
  }
}

/// Sorted by voxel, then by index: every voxel sums its points in the order of the file.
std::vector<Entry> sorted_memberships(std::span<const Eigen::Vector3f> points, float inverse_voxel, float margin) {
  constexpr std::size_t kPart = 1 << 16;
  const std::size_t parts = (points.size() + kPart - 1) / kPart;
  std::vector<std::vector<Entry>> lists(parts);
  tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
    const std::size_t end = std::min(points.size(), (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) {
      append_memberships(points[i] * inverse_voxel, margin, static_cast<std::uint32_t>(i), lists[part]);
    }
  });
  std::vector<Entry> entries;
  for (std::vector<Entry>& list : lists) {
    entries.insert(entries.end(), list.begin(), list.end());
    std::vector<Entry>().swap(list);
  }
  tbb::parallel_sort(entries.begin(), entries.end());
  return entries;
}

double median_thickness(const std::vector<Plane>& planes, const std::vector<char>& is_plane) {
  std::vector<float> thickness;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (is_plane[i] != 0) thickness.push_back(planes[i].thickness);
  }
  if (thickness.empty()) return 0.0;
  const auto middle = thickness.begin() + static_cast<std::ptrdiff_t>(thickness.size() / 2);
  std::nth_element(thickness.begin(), middle, thickness.end());
  return static_cast<double>(*middle);
}

}  // namespace

PlaneMap::PlaneMap(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options)
    : options_(options), inverse_voxel_(static_cast<float>(1.0 / options.voxel_m)) {
  if (!(options.voxel_m > 0.0)) throw std::invalid_argument("PlaneMap: voxel_m must be positive");
  if (!(options.margin_m >= 0.0 && options.margin_m < 0.5 * options.voxel_m)) {
    throw std::invalid_argument("PlaneMap: margin_m must be at least zero and less than half of voxel_m");
  }
  if (points.size() > 0x7FFFFFFFU) throw std::invalid_argument("PlaneMap: more points than one map holds");
  const std::vector<Entry> entries =
      sorted_memberships(points, inverse_voxel_, static_cast<float>(options.margin_m) * inverse_voxel_);

  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i == 0 || entries[i].key != entries[i - 1].key) starts.push_back(i);
  }
  starts.push_back(entries.size());
  const std::size_t voxels = starts.size() - 1;
  std::vector<Plane> fitted(voxels);
  std::vector<char> is_plane(voxels, 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, voxels), [&](const auto& range) {
    for (std::size_t v = range.begin(); v != range.end(); ++v) {
      const Eigen::Vector3d reference = points[entries[starts[v]].index].cast<double>();
      PointMoments moments;
      for (std::size_t i = starts[v]; i < starts[v + 1]; ++i) {
        moments.add(points[entries[i].index].cast<double>() - reference);
      }
      is_plane[v] = fit_plane(moments, reference, options_.fit, fitted[v]) ? 1 : 0;
    }
  });
  // Where floor meets wall a voxel may hold a strip of the other surface too thin to refuse by itself. It shows against
  // what the map's planes are like.
  median_thickness_m_ = median_thickness(fitted, is_plane);
  const double limit = options.max_thickness_over_median > 0.0
                           ? options.max_thickness_over_median * median_thickness_m_
                           : std::numeric_limits<double>::infinity();
  std::vector<Slot> slots;
  for (std::size_t v = 0; v < voxels; ++v) {
    const std::uint64_t key = entries[starts[v]].key;
    if (is_plane[v] != 0 && static_cast<double>(fitted[v].thickness) <= limit) {
      slots.push_back({key, static_cast<std::int32_t>(planes_.size())});
      planes_.push_back(fitted[v]);
    } else {
      slots.push_back({key, kNoPlane});
      ++rejected_voxels_;
    }
  }
  build_table(slots);
}

void PlaneMap::build_table(const std::vector<Slot>& slots) {
  std::uint64_t capacity = 16;
  while (capacity < 2 * slots.size()) capacity *= 2;
  mask_ = capacity - 1;
  table_.assign(capacity, {kEmpty, kNoPlane});
  for (const Slot& entry : slots) {
    std::uint64_t slot = spread(entry.key) & mask_;
    while (table_[slot].key != kEmpty) slot = (slot + 1) & mask_;
    table_[slot] = entry;
  }
}

PlaneMap::Found PlaneMap::find(const Eigen::Vector3i& voxel) const {
  const std::uint64_t key = make_key(voxel);
  for (std::uint64_t slot = spread(key) & mask_;; slot = (slot + 1) & mask_) {
    const Slot& entry = table_[slot];
    if (entry.key == key) {
      return {true, entry.plane == kNoPlane ? nullptr : &planes_[static_cast<std::size_t>(entry.plane)]};
    }
    if (entry.key == kEmpty) return {false, nullptr};
  }
}

const Plane* PlaneMap::at(const Eigen::Vector3f& point) const { return find(voxel_of(point, inverse_voxel_)).plane; }

const Plane* PlaneMap::match(const Eigen::Vector3f& point, float max_distance_m) const {
  const Eigen::Vector3f scaled = point * inverse_voxel_;
  const Eigen::Vector3f floor = scaled.array().floor();
  const Eigen::Vector3i voxel = floor.cast<int>();
  const Found own = find(voxel);
  if (own.occupied) {
    return own.plane != nullptr && std::abs(own.plane->distance(point)) <= max_distance_m ? own.plane : nullptr;
  }
  const Plane* best = nullptr;
  float best_distance = max_distance_m;
  for (int axis = 0; axis < 3; ++axis) {
    const float share = scaled[axis] - floor[axis];
    // Only as far over the edge as a match could be off.
    const float beyond = std::min(share, 1.0F - share) * static_cast<float>(options_.voxel_m);
    if (beyond > max_distance_m) continue;
    Eigen::Vector3i neighbour = voxel;
    neighbour[axis] += share < 0.5F ? -1 : 1;
    const Plane* candidate = find(neighbour).plane;
    if (candidate == nullptr) continue;
    const float distance = std::abs(candidate->distance(point));
    if (distance <= best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace lodestone
