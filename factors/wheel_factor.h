#pragma once

#include <ceres/sized_cost_function.h>

#include "core/wheels/wheel_residual.h"

namespace lodestone {

/// The wheels' mean velocity between two keyframes against the motion at the later one (wheel_residual.h). Parameters:
/// pose (7), motion (9: v, b_g, b_a), calibration of the wheels (4: scale, rotation vector), slip (1), which adds to
/// the scale. The reading's sigmas contain its robust weights.
class WheelFactor final : public ceres::SizedCostFunction<3, 7, 9, kWheelParameters, 1> {
 public:
  explicit WheelFactor(const WheelReading& reading) : reading_(reading) {}

  void set(const WheelReading& reading) { reading_ = reading; }
  const WheelReading& reading() const { return reading_; }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  WheelReading reading_;
};

}  // namespace lodestone
