#include "core/mapping/free_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/lidar/voxel_planes.h"
#include "core/log_odds.h"
#include "core/parallel.h"

namespace lodestone {

namespace {

/// Edge of a block in voxels. A ray visits blocks, most of which are empty, instead of voxels.
constexpr int kBlockVoxels = 8;
/// Probabilities that a voxel is occupied after one scan that hits it, or passes it (OctoMap).
constexpr double kOccupiedIfHit = 0.7;
constexpr double kOccupiedIfPassed = 0.4;
/// Smallest distance from a passed point to the surface behind: three standard deviations of range noise and of the
/// survey's poses at 30 m (docs/design/052).
constexpr double kInFront_m = 0.1;

std::uint64_t block_of(std::uint64_t voxel) {
  const auto divided = [](int index) { return index >> 3; };  // floor, also below zero
  static_assert(kBlockVoxels == 1 << 3);
  return voxel_key(voxel_of_key(voxel).unaryExpr(divided));
}

std::vector<VoxelMean> in_order_of_blocks(std::vector<VoxelMean> voxels, double voxel_m) {
  if (!(voxel_m > 0.0)) throw std::invalid_argument("FreeSpace: voxel_m must be positive");
  std::sort(voxels.begin(), voxels.end(), [](const VoxelMean& a, const VoxelMean& b) {
    const std::uint64_t block_a = block_of(a.voxel), block_b = block_of(b.voxel);
    return block_a != block_b ? block_a < block_b : a.voxel < b.voxel;
  });
  return voxels;
}

/// The surfaces on which rays end.
PlaneMap surfaces_of(std::span<const VoxelMean> voxels, double voxel_m) {
  PlaneMapOptions options;
  options.voxel_m = std::max(options.voxel_m, 5.0 * voxel_m);  // 25 points on a surface
  options.max_thickness_over_median = 0.0;                     // means have little noise, and their median says little
  std::vector<Eigen::Vector3f> points;
  points.reserve(voxels.size());
  for (const VoxelMean& voxel : voxels) points.push_back(voxel.position);
  return PlaneMap(points, options);
}

/// Calls `visit` for each block from `begin` to `end` (in units of blocks), in order of the way (Amanatides & Woo
/// 1987).
template <class Visit>
void visit_blocks(const Vector3& begin, const Vector3& end, const Visit& visit) {
  Eigen::Vector3i block = begin.array().floor().cast<int>();
  const Eigen::Vector3i last = end.array().floor().cast<int>();
  std::array<int, 3> left{}, step{};
  std::array<double, 3> next{}, spacing{};  // share of the way at the next face, and between faces
  int steps = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = end[axis] - begin[axis];
    left[axis] = std::abs(last[axis] - block[axis]);
    step[axis] = last[axis] > block[axis] ? 1 : -1;
    steps += left[axis];
    spacing[axis] = 1.0 / std::abs(way);
    next[axis] = left[axis] == 0 ? std::numeric_limits<double>::infinity()
                                 : (block[axis] + (step[axis] > 0 ? 1 : 0) - begin[axis]) / way;
  }
  visit(block);
  for (; steps > 0; --steps) {
    const auto axis = static_cast<std::size_t>(std::min_element(next.begin(), next.end()) - next.begin());
    block[static_cast<int>(axis)] += step[axis];
    next[axis] = --left[axis] == 0 ? std::numeric_limits<double>::infinity() : next[axis] + spacing[axis];
    visit(block);
  }
}

}  // namespace

FreeSpace::FreeSpace(std::vector<VoxelMean> voxels, double voxel_m)
    : voxels_(in_order_of_blocks(std::move(voxels), voxel_m)),
      evidence_(voxels_.size()),
      voxel_m_(voxel_m),
      in_front_m_(static_cast<float>(std::max(kInFront_m, 2.0 * voxel_m))),
      surfaces_(surfaces_of(voxels_, voxel_m)) {
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    const auto index = static_cast<std::uint32_t>(i);
    Range& range = blocks_.try_emplace(block_of(voxels_[i].voxel), Range{index, index}).first->second;
    range.end = index + 1;
  }
}

/// Marks the voxel in which a ray ends. False if an earlier ray of this scan ends in it too: their lines are almost the
/// same.
bool FreeSpace::hit(const Eigen::Vector3f& end) {
  const std::uint64_t voxel = voxel_key(voxel_of(end, static_cast<float>(1.0 / voxel_m_)));
  const auto block = blocks_.find(block_of(voxel));
  if (block == blocks_.end()) return true;
  const auto begin = voxels_.begin() + block->second.begin, last = voxels_.begin() + block->second.end;
  const auto found =
      std::lower_bound(begin, last, voxel, [](const VoxelMean& mean, std::uint64_t key) { return mean.voxel < key; });
  if (found == last || found->voxel != voxel) return true;
  Evidence& evidence = evidence_[static_cast<std::size_t>(found - voxels_.begin())];
  if (evidence.last_hit == scan_) return false;
  evidence.last_hit = scan_;
  ++evidence.hits;
  return true;
}

/// Appends the voxels whose mean points lie within half an edge of the ray, and well in front of the `surface` on which
/// the ray ends. The distance from the surface counts and not that along the ray: a ray that grazes a floor is close to
/// the floor for metres.
void FreeSpace::append_passed(const LidarRay& ray, const Plane& surface, std::vector<std::uint32_t>& passed) const {
  const Eigen::Vector3f way = ray.end - ray.origin;
  const float length = way.norm();
  if (!(length > 0.0F)) return;
  const Eigen::Vector3f direction = way / length;
  const float side = surface.normal.dot(direction) > 0.0F ? -1.0F : 1.0F;  // the normal towards the LiDAR
  const auto radius = static_cast<float>(0.5 * voxel_m_);
  const double blocks_per_m = 1.0 / (kBlockVoxels * voxel_m_);
  visit_blocks(ray.origin.cast<double>() * blocks_per_m, ray.end.cast<double>() * blocks_per_m,
               [&](const Eigen::Vector3i& block) {
                 const auto found = blocks_.find(voxel_key(block));
                 if (found == blocks_.end()) return;
                 for (std::uint32_t i = found->second.begin; i < found->second.end; ++i) {
                   const Eigen::Vector3f from_origin = voxels_[i].position - ray.origin;
                   const float along = direction.dot(from_origin);
                   if (along <= 0.0F || along >= length) continue;
                   if ((from_origin - along * direction).squaredNorm() > radius * radius) continue;
                   if (side * surface.distance(voxels_[i].position) < in_front_m_) continue;
                   passed.push_back(i);
                 }
               });
}

void FreeSpace::add_scan(std::span<const LidarRay> rays) {
  ++scan_;
  std::vector<const LidarRay*> distinct;
  distinct.reserve(rays.size());
  for (const LidarRay& ray : rays) {
    if (hit(ray.end)) distinct.push_back(&ray);
  }
  constexpr std::size_t kPart = 512;
  const std::size_t parts = (distinct.size() + kPart - 1) / kPart;
  std::vector<std::vector<std::uint32_t>> passed(parts);
  parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
    const std::size_t end = std::min(distinct.size(), (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) {
      const LidarRay& ray = *distinct[i];
      if (const Plane* surface = surfaces_.at(ray.end)) append_passed(ray, *surface, passed[part]);
    }
  });
  for (const std::vector<std::uint32_t>& list : passed) {
    for (const std::uint32_t index : list) {
      Evidence& evidence = evidence_[index];
      if (evidence.last_hit == scan_ || evidence.last_pass == scan_) continue;
      evidence.last_pass = scan_;
      ++evidence.passes;
    }
  }
}

std::vector<VoxelMean> FreeSpace::occupied() const {
  const double hit = log_odds(kOccupiedIfHit), pass = log_odds(kOccupiedIfPassed);
  std::vector<VoxelMean> result;
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    if (evidence_[i].hits * hit + evidence_[i].passes * pass >= 0.0) result.push_back(voxels_[i]);
  }
  return result;
}

}  // namespace lodestone
