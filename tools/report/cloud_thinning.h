#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "tools/plotting/plan_sheet.h"

namespace lodestone {

/// Thins a streamed cloud of any size to at most `limit` points: the first point of each voxel. Voxels grow if there
/// are too many points, so that memory is bounded by `limit`. The same points in the same order give the same result.
class CloudThinning {
 public:
  /// Points outside `box` are ignored. `voxel_m`: the finest spacing.
  CloudThinning(PlanExtent box, std::size_t limit, double voxel_m);

  void add(std::span<const Eigen::Vector3f> points);

  /// The kept points in their order of arrival.
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

  double voxel_m() const { return voxel_m_; }

 private:
  bool take(const Eigen::Vector3f& point);
  void coarsen();

  PlanExtent box_;
  std::size_t limit_;
  double voxel_m_;
  std::vector<Eigen::Vector3f> points_;
  std::unordered_map<std::uint64_t, char> taken_;
};

}  // namespace lodestone
