#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "core/lidar/correspondence.h"
#include "factors/pose_mask.h"

namespace lodestone {

/// One residual per point: √w nᵀ(R p + t − q). The condensed factor replaces it; kept for ablations and as reference in
/// tests. Parameter: pose (7).
class PointPlaneFactor final : public ceres::CostFunction {
 public:
  PointPlaneFactor(std::vector<Correspondence> correspondences, const PoseMask& mask);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  void set_mask(const PoseMask& mask) { mask_ = mask; }
  const PoseMask& mask() const { return mask_; }

 private:
  std::vector<Correspondence> correspondences_;
  PoseMask mask_;
};

}  // namespace lodestone
