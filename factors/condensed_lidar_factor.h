#pragma once

#include <ceres/cost_function.h>

#include "core/lidar/swept_cost.h"
#include "factors/pose_mask.h"
#include "factors/seen_pose.h"

namespace lodestone {

/// All point-to-plane residuals of a scan, condensed to twenty-five: e = F [ξ(x); η], Fᵀ F = M (SweptCost). Cost,
/// gradient and Gauss-Newton Hessian equal those of one residual per point, with point positions that depend on the
/// states at both ends of the deskewing step. LiDAR calibration and map error move the pose at which the scan is
/// evaluated (SeenState). The mask removes directions of the pose and of the departure. The residuals do not change if
/// all poses and velocities slide together along a masked direction. Parameters: pose (7) and motion (9: v, b_g, b_a)
/// at the scan's end; pose and motion of the previous keyframe, if any; LiDAR calibration (7: rotation, shift, clock)
/// and map error (6), if estimated. The content may be replaced between solves, so that the Ceres problem persists.
/// Source: docs/design/008-swept-scan-factor.md.
class CondensedLidarFactor final : public ceres::CostFunction {
 public:
  struct Blocks {
    bool before = false;
    bool calibration = false;
    bool map_error = false;
  };

  CondensedLidarFactor(const CondensedScan& scan, const PoseMask& mask, const Blocks& blocks);

  void set(const CondensedScan& scan, const PoseMask& mask);

  /// Rates of motion at both ends of the step, which are assumed to be known.
  void set_rates(const MotionRates& end, const MotionRates& before) {
    end_rates_ = end;
    before_rates_ = before;
  }

  void set_mask(const PoseMask& mask) { mask_ = mask; }
  const PoseMask& mask() const { return mask_; }
  bool by_lidar() const { return scan_.by_lidar; }
  const Matrix6& long_map_error_root() const { return scan_.long_map_error_root; }

  /// Pose of the scan in the map, before the mask, with an exact clock. Null arguments: not estimated.
  SeenPose seen(const Pose& T_map_imu, const double* calibration, const double* map_error) const;

  /// Time derivative of the scan's pose at a state (φ right, p map), per second.
  Vector6 rate_at(const NavState& state) const;

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Blocks blocks_;
  CondensedScan scan_;
  Matrix25 root_ = Matrix25::Zero();
  PoseMask mask_;
  MotionRates end_rates_;
  MotionRates before_rates_;
};

}  // namespace lodestone
