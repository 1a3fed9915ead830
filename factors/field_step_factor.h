#pragma once

#include <ceres/sized_cost_function.h>

#include "core/calibration/magnetometer_calibration.h"

namespace lodestone {

/// The field about a robot changes but slowly while the robot turns beneath it:
///   r = α y' − β A ΔRᵀ A⁻¹ y,
/// y and y' what the array as a whole reads before and after, in imu axes, ΔR the turn between (it takes axes after to
/// axes before) and A the distortion that all magnetometers share. y is a reading, not a field: were it the field, a
/// distortion that makes every reading larger would make every y and so every r smaller, and seem to be known.
/// Parameters: y (3, µT), y' (3, µT), nine numbers of A, gyroscope bias (3, rad/s; ΔR was integrated without).
class FieldStepFactor final : public ceres::SizedCostFunction<3, 3, 3, 9, 3> {
 public:
  struct Step {
    Quaternion turn = Quaternion::Identity();  ///< ΔR at zero bias
    Matrix3 turn_by_bias = Matrix3::Zero();    ///< ΔR(bias) = ΔR Exp(turn_by_bias · bias)
    double after_weight = 1.0;                 ///< α, 1/µT
    double before_weight = 1.0;                ///< β, 1/µT
  };

  explicit FieldStepFactor(const Step& step) : step_(step) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Step step_;
};

}  // namespace lodestone
