#pragma once

#include <ceres/cost_function.h>

#include "core/lidar/swept_cost.h"
#include "factors/pose_mask.h"

namespace lodestone {

/// All point-to-plane residuals of a scan as twenty-five: e = F [ξ(x); η], Fᵀ F = M (SweptCost). Cost, gradient and
/// Gauss-Newton Hessian are those of one residual a point whose place depends on the states at both ends of the step
/// that the scan was deskewed over. The mask hides directions of the pose and of the departure alike. Parameters: pose
/// (7) and motion (9: v, b_g, b_a) at the scan's end and, where a keyframe comes before, its pose and motion. Its
/// content may be renewed between solves, so that the Ceres problem persists.
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
  Matrix25 root_ = Matrix25::Zero();
  PoseMask mask_;
};

}  // namespace lodestone
