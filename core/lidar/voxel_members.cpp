#include "core/lidar/voxel_members.h"

#include <algorithm>
#include <stdexcept>

#include "core/parallel.h"
#include "core/parallel_sort.h"

namespace lodestone {

namespace {

using Wanted = std::function<bool(const Eigen::Vector3i&)>;

/// Beyond, a key would be that of a voxel elsewhere.
bool has_key(const Eigen::Vector3i& voxel) {
  return voxel.minCoeff() >= -voxels_to_a_side && voxel.maxCoeff() < voxels_to_a_side;
}

void append_memberships(const VoxelRange& range, std::uint32_t index, const Wanted& wanted,
                        std::vector<VoxelMember>& entries) {
  for (int x = range.low.x(); x <= range.high.x(); ++x) {
    for (int y = range.low.y(); y <= range.high.y(); ++y) {
      for (int z = range.low.z(); z <= range.high.z(); ++z) {
        const Eigen::Vector3i voxel(x, y, z);
        if (has_key(voxel) && (!wanted || wanted(voxel))) entries.push_back({voxel_key(voxel), index});
      }
    }
  }
}

}  // namespace

std::vector<VoxelMember> sorted_members(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options,
                                        const Wanted& wanted) {
  if (points.size() > 0x7FFFFFFFU) throw std::invalid_argument("PlaneMap: more points than one map holds");
  const VoxelMembership membership(options);
  constexpr std::size_t kPart = 1 << 16;
  const std::size_t parts = (points.size() + kPart - 1) / kPart;
  std::vector<std::vector<VoxelMember>> lists(parts);
  parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
    const std::size_t end = std::min(points.size(), (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) {
      append_memberships(membership.of(points[i]), static_cast<std::uint32_t>(i), wanted, lists[part]);
    }
  });
  std::vector<VoxelMember> entries;
  for (std::vector<VoxelMember>& list : lists) {
    entries.insert(entries.end(), list.begin(), list.end());
    std::vector<VoxelMember>().swap(list);
  }
  parallel_sort(entries.begin(), entries.end());
  return entries;
}

std::vector<std::size_t> voxel_starts(std::span<const VoxelMember> members) {
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (i == 0 || members[i].key != members[i - 1].key) starts.push_back(i);
  }
  starts.push_back(members.size());
  return starts;
}

}  // namespace lodestone
