#include "core/mapping/voxel_means.h"

#include <algorithm>
#include <stdexcept>

#include "core/lidar/voxel_planes.h"

namespace lodestone {

VoxelMeans::VoxelMeans(double voxel_m)
    : voxel_m_(voxel_m),
      inverse_voxel_(static_cast<float>(1.0 / voxel_m)),
      reach_m_(static_cast<float>(voxels_reach_m(voxel_m))) {
  if (!(voxel_m > 0.0)) throw std::invalid_argument("VoxelMeans: voxel_m must be positive");
}

void VoxelMeans::add(const Eigen::Vector3f& point) {
  if (!(point.cwiseAbs().maxCoeff() < reach_m_)) return;
  const Eigen::Vector3i voxel = voxel_of(point, inverse_voxel_);
  Sum& sum = sums_[voxel_key(voxel)];
  sum.offset += point.cast<double>() - voxel_m_ * voxel.cast<double>();
  ++sum.points;
}

std::vector<VoxelMean> VoxelMeans::means(int min_points) const {
  std::vector<VoxelMean> result;
  for (const auto& [key, sum] : sums_) {
    if (sum.points < static_cast<std::uint32_t>(std::max(min_points, 1))) continue;
    const Vector3 mean = voxel_m_ * voxel_of_key(key).cast<double>() + sum.offset / sum.points;
    result.push_back({key, mean.cast<float>(), sum.points});
  }
  std::sort(result.begin(), result.end(), [](const VoxelMean& a, const VoxelMean& b) { return a.voxel < b.voxel; });
  return result;
}

}  // namespace lodestone
