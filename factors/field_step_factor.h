#pragma once

#include <ceres/sized_cost_function.h>

#include "core/calibration/magnetometer_calibration.h"

namespace lodestone {

/// The field around a robot changes slowly while the robot rotates in it:
///   r = α y' − β A ΔRᵀ A⁻¹ y,
/// with the mean readings y and y' of the array before and after in imu axes, the rotation ΔR between them (from axes
/// after to axes before), and the distortion A that all magnetometers share. y is a reading, not a field. With a field,
/// a distortion that increases every reading would decrease every y and r, and would seem observable. Parameters: y (3,
/// µT), y' (3, µT), nine numbers of A, gyroscope bias (3, rad/s; ΔR was integrated without bias).
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
