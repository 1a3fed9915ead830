#include "core/lidar/voxel_planes.h"

#include <algorithm>
#include <boost/sort/spreadsort/integer_sort.hpp>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "core/parallel.h"

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
};

using Wanted = std::function<bool(const Eigen::Vector3i&)>;

/// A voxel outside would get the key of another voxel.
bool has_key(const Eigen::Vector3i& voxel) {
  return voxel.minCoeff() >= -kOffset && voxel.maxCoeff() < kOffset;
}

template <class Visit>
void for_each_voxel(const VoxelRange& range, const Wanted& wanted, const Visit& visit) {
  for (int x = range.low.x(); x <= range.high.x(); ++x) {
    for (int y = range.low.y(); y <= range.high.y(); ++y) {
      for (int z = range.low.z(); z <= range.high.z(); ++z) {
        const Eigen::Vector3i voxel(x, y, z);
        if (has_key(voxel) && (!wanted || wanted(voxel))) visit(voxel);
      }
    }
  }
}

/// The members of all voxels in one piece of memory, whose size is counted before: fresh memory costs more than a
/// count.
class Members {
 public:
  Members(std::span<const Eigen::Vector3f> points, const VoxelMembership& membership, const Wanted& wanted) {
    constexpr std::size_t kPart = 1 << 16;
    const std::size_t parts = (points.size() + kPart - 1) / kPart;
    std::vector<std::size_t> begins(parts + 1, 0);
    const auto for_each_of = [&](std::size_t part, const auto& visit) {
      const std::size_t end = std::min(points.size(), (part + 1) * kPart);
      for (std::size_t i = part * kPart; i < end; ++i) {
        for_each_voxel(membership.of(points[i]), wanted, [&](const Eigen::Vector3i& voxel) { visit(voxel, i); });
      }
    };
    parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
      std::size_t count = 0;
      for_each_of(part, [&count](const Eigen::Vector3i&, std::size_t) { ++count; });
      begins[part + 1] = count;
    });
    std::partial_sum(begins.begin(), begins.end(), begins.begin());
    entries_ = std::make_unique_for_overwrite<Entry[]>(begins.back());
    parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
      Entry* entry = &entries_[begins[part]];
      for_each_of(part, [&entry](const Eigen::Vector3i& voxel, std::size_t i) {
        *entry++ = {voxel_key(voxel), static_cast<std::uint32_t>(i)};
      });
    });
    sort_by_voxel(begins.back());
  }

  std::size_t voxels() const { return starts_.size() - 1; }

  /// Ordered by index: every voxel sums its points in the order of the file. Call once for each voxel.
  std::span<const Entry> of(std::size_t voxel) {
    const std::span<Entry> members(&entries_[starts_[voxel]], starts_[voxel + 1] - starts_[voxel]);
    std::sort(members.begin(), members.end(), [](const Entry& a, const Entry& b) { return a.index < b.index; });
    return members;
  }

 private:
  void sort_by_voxel(std::size_t count) {
    Entry* const begin = entries_.get();
    boost::sort::spreadsort::integer_sort(
        begin, begin + count, [](const Entry& entry, unsigned shift) { return entry.key >> shift; },
        [](const Entry& a, const Entry& b) { return a.key < b.key; });
    for (std::size_t i = 0; i < count; ++i) {
      if (i == 0 || begin[i].key != begin[i - 1].key) starts_.push_back(i);
    }
    starts_.push_back(count);
  }

  std::unique_ptr<Entry[]> entries_;
  std::vector<std::size_t> starts_;  // of each voxel, and the end
};

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
  Members members(points, VoxelMembership(options), wanted);
  std::vector<VoxelPlane> voxels(members.voxels());
  parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t v) {
    const std::span<const Entry> own = members.of(v);
    const Eigen::Vector3d reference = points[own.front().index].cast<double>();
    PointMoments moments;
    for (const Entry& entry : own) moments.add(points[entry.index].cast<double>() - reference);
    voxels[v].key = own.front().key;
    voxels[v].is_flat = fit_plane(moments, reference, options.fit, voxels[v].plane) ? 1 : 0;
    if (voxels[v].is_flat != 0) take_height_from_within(points, own, options, voxels[v].plane);
  });
  return voxels;
}

}  // namespace lodestone
