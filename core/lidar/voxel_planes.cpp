#include "core/lidar/voxel_planes.h"

#include <algorithm>
#include <stdexcept>

#include "core/parallel.h"
#include "core/parallel_sort.h"

namespace lodestone {

namespace {

// Bits of one axis in a voxel's key.
constexpr int kBits = 21;
constexpr int kOffset = voxels_to_a_side;
static_assert(kOffset == 1 << (kBits - 1));

/// A point as a member of a voxel: of its own, or of one whose margin contains the point.
struct Entry {
  std::uint64_t key;
  std::uint32_t index;
  bool operator<(const Entry& other) const { return key != other.key ? key < other.key : index < other.index; }
};

using Wanted = std::function<bool(const Eigen::Vector3i&)>;

/// A voxel outside would get the key of another voxel.
bool has_key(const Eigen::Vector3i& voxel) {
  return voxel.minCoeff() >= -kOffset && voxel.maxCoeff() < kOffset;
}

void append_memberships(const VoxelRange& range, std::uint32_t index, const Wanted& wanted,
                        std::vector<Entry>& entries) {
  for (int x = range.low.x(); x <= range.high.x(); ++x) {
    for (int y = range.low.y(); y <= range.high.y(); ++y) {
      for (int z = range.low.z(); z <= range.high.z(); ++z) {
        const Eigen::Vector3i voxel(x, y, z);
        if (has_key(voxel) && (!wanted || wanted(voxel))) entries.push_back({voxel_key(voxel), index});
      }
    }
  }
}

/// Sorted by voxel, then by index: every voxel sums its points in the order of the file.
std::vector<Entry> sorted_memberships(std::span<const Eigen::Vector3f> points, const VoxelMembership& membership,
                                      const Wanted& wanted) {
  constexpr std::size_t kPart = 1 << 16;
  const std::size_t parts = (points.size() + kPart - 1) / kPart;
  std::vector<std::vector<Entry>> lists(parts);
  parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
    const std::size_t end = std::min(points.size(), (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) {
      append_memberships(membership.of(points[i]), static_cast<std::uint32_t>(i), wanted, lists[part]);
    }
  });
  std::vector<Entry> entries;
  for (std::vector<Entry>& list : lists) {
    entries.insert(entries.end(), list.begin(), list.end());
    std::vector<Entry>().swap(list);
  }
  parallel_sort(entries.begin(), entries.end());
  return entries;
}

/// Moves the plane's height to that of the points whose foot lies within the voxel, where scans meet the plane. With
/// the points of the margin the chord of a curved surface is longer and lies too deep. Normal and thickness stay those
/// of the whole box: the normal of the voxel alone has five times the variance (docs/design/001).
void take_height_from_within(std::span<const Eigen::Vector3f> points, std::span<const Entry> members,
                             const PlaneMapOptions& options, Plane& plane) {
  constexpr float kTolerance_m = 0.005F;  // for walls whose noise crosses the voxel's faces
  const auto edge = static_cast<float>(options.voxel_m);
  const Eigen::Vector3f low = voxel_of_key(members.front().key).cast<float>() * edge;
  Vector3 sum = Vector3::Zero();
  int count = 0;
  for (const Entry& member : members) {
    const Eigen::Vector3f& point = points[member.index];
    const Eigen::Vector3f foot = point - plane.normal * plane.distance(point) - low;
    if ((foot.array() < -kTolerance_m).any() || (foot.array() > edge + kTolerance_m).any()) continue;
    sum += (point - low).cast<double>();
    ++count;
  }
  if (count < options.fit.min_points) return;
  plane.center = low + (sum / count).cast<float>();
  plane.offset_variance *= static_cast<float>(plane.count) / static_cast<float>(count);
}

}  // namespace

std::uint64_t voxel_key(const Eigen::Vector3i& voxel) {
  const auto part = [](int value) { return static_cast<std::uint64_t>(value + kOffset) & ((1U << kBits) - 1U); };
  return part(voxel.x()) << (2 * kBits) | part(voxel.y()) << kBits | part(voxel.z());
}

Eigen::Vector3i voxel_of_key(std::uint64_t key) {
  const auto part = [key](int shift) { return static_cast<int>(key >> shift & ((1U << kBits) - 1U)) - kOffset; };
  return {part(2 * kBits), part(kBits), part(0)};
}

VoxelMembership::VoxelMembership(const PlaneMapOptions& options)
    : inverse_voxel_(static_cast<float>(1.0 / options.voxel_m)),
      margin_(static_cast<float>(options.margin_m) * inverse_voxel_) {
  if (!(options.voxel_m > 0.0)) throw std::invalid_argument("PlaneMap: voxel_m must be positive");
  if (!(options.margin_m >= 0.0 && options.margin_m < 0.5 * options.voxel_m)) {
    throw std::invalid_argument("PlaneMap: margin_m must be at least zero and less than half of voxel_m");
  }
}

std::vector<VoxelPlane> fit_voxel_planes(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options,
                                         const Wanted& wanted) {
  if (points.size() > 0x7FFFFFFFU) throw std::invalid_argument("PlaneMap: a map has at most 2147483647 points");
  const std::vector<Entry> entries = sorted_memberships(points, VoxelMembership(options), wanted);
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i == 0 || entries[i].key != entries[i - 1].key) starts.push_back(i);
  }
  starts.push_back(entries.size());
  std::vector<VoxelPlane> voxels(starts.size() - 1);
  parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t v) {
    const Eigen::Vector3d reference = points[entries[starts[v]].index].cast<double>();
    PointMoments moments;
    for (std::size_t i = starts[v]; i < starts[v + 1]; ++i) {
      moments.add(points[entries[i].index].cast<double>() - reference);
    }
    voxels[v].key = entries[starts[v]].key;
    voxels[v].is_flat = fit_plane(moments, reference, options.fit, voxels[v].plane) ? 1 : 0;
    if (voxels[v].is_flat != 0) {
      take_height_from_within(points, std::span(entries).subspan(starts[v], starts[v + 1] - starts[v]), options,
                              voxels[v].plane);
    }
  });
  return voxels;
}

}  // namespace lodestone
