#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "tools/plotting/plan_sheet.h"

namespace lodestone {

/// Thins a cloud of any size to at most `limit` points as it streams by: one point a voxel, the first that came. The
/// voxels grow whenever more are taken than wanted, so memory is bounded by `limit`. The same points in the same order
/// give the same result.
class CloudThinning {
 public:
  /// Points outside `box` are left out. `voxel_m`: the finest spacing worth keeping.
  CloudThinning(PlanStretch box, std::size_t limit, double voxel_m);

  void add(std::span<const Eigen::Vector3f> points);

  /// The kept points in the order in which they came.
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

  double voxel_m() const { return voxel_m_; }

 private:
  bool take(const Eigen::Vector3f& point);
  void coarsen();

  PlanStretch box_;
  std::size_t limit_;
  double voxel_m_;
  std::vector<Eigen::Vector3f> points_;
  std::unordered_map<std::uint64_t, char> taken_;
};

}  // namespace lodestone
