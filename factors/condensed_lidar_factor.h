#pragma once

#include <ceres/sized_cost_function.h>

#include "core/registration/condensed_cost.h"
#include "factors/pose_mask.h"

namespace lodestone {

/// All point-to-plane residuals of a scan as thirteen: e = F ξ(x), Fᵀ F = M. Cost, gradient and Gauss-Newton Hessian are
/// those of one residual a point, at every pose (docs/architecture.md). Parameter: pose (7).
/// Its content may be renewed between solves, so that the Ceres problem persists.
class CondensedLidarFactor final : public ceres::SizedCostFunction<13, 7> {
 public:
  CondensedLidarFactor(const CondensedCost& cost, const PoseMask& mask) { set(cost, mask); }

  void set(const CondensedCost& cost, const PoseMask& mask);

  /// The same with an error common to all points of the scan, as deskewing by a noisy IMU leaves it: a pose error of
  /// covariance `common` (6×6, φ, p) at `T_map_imu`. Its effect on the thirteen residuals is whitened away, which turns
  /// the information H into H (I + common H)⁻¹.
  void set(const CondensedCost& cost, const PoseMask& mask, const Matrix6& common, const Pose& T_map_imu);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  /// For checkpoints.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(cost_, root_, mask_);
  }

 private:
  CondensedCost cost_;
  Matrix13 root_ = Matrix13::Zero();
  PoseMask mask_;
};

}  // namespace lodestone
