#pragma once

#include <ceres/cost_function.h>

#include "core/lidar/swept_cost.h"
#include "factors/pose_mask.h"
#include "factors/seen_pose.h"

namespace lodestone {

/// All point-to-plane residuals of a scan as twenty-five: e = F [ξ(x); η], Fᵀ F = M (SweptCost). Cost, gradient and
/// Gauss-Newton Hessian are those of one residual a point whose place depends on the states at both ends of the step
/// that the scan was deskewed over. The calibration of the LiDAR and the error of the map move the pose that the scan
/// sees (SeenState). The mask hides directions of the pose and of the departure alike; all poses and velocities
/// may slide together along what it hides, the rest unchanged, and nothing is felt. Parameters: pose (7) and motion (9:
/// v, b_g, b_a) at the scan's end; where a keyframe comes before, its pose and motion; where they are estimated, the
/// LiDAR's calibration (7: turn, shift, clock) and the map's error (6). Its content may be renewed between solves, so
/// that the Ceres problem persists.
class CondensedLidarFactor final : public ceres::CostFunction {
 public:
  struct Blocks {
    bool before = false;
    bool calibration = false;
    bool map_error = false;
  };

  CondensedLidarFactor(const CondensedScan& scan, const PoseMask& mask, const Blocks& blocks);

  void set(const CondensedScan& scan, const PoseMask& mask);

  /// How the robot moves at both ends of the step: taken as known.
  void set_rates(const MotionRates& end, const MotionRates& before) {
    end_rates_ = end;
    before_rates_ = before;
  }

  void set_mask(const PoseMask& mask) { mask_ = mask; }
  const PoseMask& mask() const { return mask_; }
  bool by_lidar() const { return scan_.by_lidar; }
  const Matrix6& long_map_error_root() const { return scan_.long_map_error_root; }

  /// Where the scan is seen, before the mask, if its clock is right. Null: not estimated.
  SeenPose seen(const Pose& T_map_imu, const double* calibration, const double* map_error) const;

  /// How the pose moves with time at a state where the scan is (φ right, p map), a second.
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
