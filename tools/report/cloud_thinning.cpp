#include "tools/report/cloud_thinning.h"

#include <cmath>

namespace lodestone {

namespace {

/// 21 bits per axis: 20 km with voxels of a centimetre.
std::uint64_t voxel_key(const Eigen::Vector3f& point, double voxel_m) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<std::int64_t>(std::floor(static_cast<double>(point(axis)) / voxel_m));
    key = (key << 21) | (static_cast<std::uint64_t>(index) & 0x1fffffU);
  }
  return key;
}

}  // namespace

CloudThinning::CloudThinning(PlanExtent box, std::size_t limit, double voxel_m)
    : box_(box), limit_(limit), voxel_m_(voxel_m) {}

bool CloudThinning::take(const Eigen::Vector3f& point) {
  if (!taken_.try_emplace(voxel_key(point, voxel_m_), 1).second) return false;
  points_.push_back(point);
  return true;
}

void CloudThinning::coarsen() {
  constexpr double kGrowth = 1.25;
  voxel_m_ *= kGrowth;
  taken_.clear();
  const std::vector<Eigen::Vector3f> before = std::move(points_);
  points_.clear();
  for (const Eigen::Vector3f& point : before) take(point);
}

void CloudThinning::add(std::span<const Eigen::Vector3f> points) {
  for (const Eigen::Vector3f& point : points) {
    if (!box_.contains(point.x(), point.y())) continue;
    take(point);
    while (points_.size() > limit_) coarsen();
  }
}

}  // namespace lodestone
