#pragma once

#include <ceres/sized_cost_function.h>

#include "factors/pose_mask.h"

namespace lodestone {

/// A measured pose with its information: r = A (x ⊟ x_m), AᵀA the information (tangent order φ, p). Along unobserved
/// directions A has no rows and x_m is arbitrary.
struct MeasuredPose {
  Pose T_map_imu;                  ///< x_m
  Matrix6 root = Matrix6::Zero();  ///< A; zero without information
};

/// A measured pose as a keyframe's factor. Parameter: pose (7). The content may be replaced between solves, so that the
/// Ceres problem persists.
class PoseFactor final : public ceres::SizedCostFunction<6, 7> {
 public:
  PoseFactor(const MeasuredPose& measured, const PoseMask& mask) { set(measured, mask); }

  void set(const MeasuredPose& measured, const PoseMask& mask);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  MeasuredPose measured_;
  PoseMask mask_;
};

}  // namespace lodestone
