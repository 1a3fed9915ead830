#pragma once

#include <ceres/cost_function.h>

#include "core/lidar/swept_cost.h"
#include "factors/pose_mask.h"

namespace lodestone {

/// All point-to-plane residuals of a scan as nineteen: e = F [ξ(x); η], Fᵀ F = M (SweptCost). Cost, gradient and Gauss-Newton
/// Hessian are those of one residual a point whose place hangs on all states that deskewing leaned on
/// (docs/architecture.md). The mask hides directions of the pose and of the rates alike.
/// Parameters: pose (7) and motion (9: v, b_g, b_a) at the scan's end and, where a keyframe comes before, its pose (7).
/// Its content may be renewed between solves, so that the Ceres problem persists.
class CondensedLidarFactor final : public ceres::CostFunction {
 public:
  CondensedLidarFactor(const CondensedScan& scan, const PoseMask& mask, bool has_before);

  void set(const CondensedScan& scan, const PoseMask& mask);

  void set_mask(const PoseMask& mask) { mask_ = mask; }
  const PoseMask& mask() const { return mask_; }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;


 private:
  bool has_before() const { return parameter_block_sizes().size() > 2; }

  CondensedCost cost_;
  Deskewing deskewing_;
  Matrix19 root_ = Matrix19::Zero();
  PoseMask mask_;
};

}  // namespace lodestone
