#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/lidar/voxel_planes.h"

namespace lodestone {

/// A point as a member of a voxel: its own one, or one that it lies just outside of.
struct VoxelMember {
  std::uint64_t key;
  std::uint32_t index;
  bool operator<(const VoxelMember& other) const { return key != other.key ? key < other.key : index < other.index; }
};

/// The members of all voxels of `points` (map frame, metres; finite) for which `wanted` holds (null: all). Sorted by
/// voxel, then by index: every voxel sums its points in the order of the file. Throws std::invalid_argument where there
/// are more than 2³¹ − 1 points.
std::vector<VoxelMember> sorted_members(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options,
                                        const std::function<bool(const Eigen::Vector3i&)>& wanted = nullptr);

/// Where each voxel begins in `members`, and their end.
std::vector<std::size_t> voxel_starts(std::span<const VoxelMember> members);

}  // namespace lodestone
