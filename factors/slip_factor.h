#pragma once

#include <ceres/cost_function.h>

#include <algorithm>
#include <cmath>

namespace lodestone {

/// Slip of the wheels as a Gauss-Markov process with the stationary σ: r = √w (second − decay · first) / (σ √(1 −
/// decay²)). Parameters: two blocks of one number; or only the second, if it is the first of the process: r = √w second
/// / σ. Jumps are allowed: the weight w is that of a Student distribution with four degrees of freedom, at most one. It
/// is constant during a solve (renew), so that a jump that the IMU requires costs little (docs/design/049-wheels.md).
class SlipFactor final : public ceres::CostFunction {
 public:
  /// `decay`: in [0, 1); 0 for one block.
  SlipFactor(double sigma, double decay)
      : step_sigma_(sigma * std::sqrt(1.0 - decay * decay)), decay_(decay), whitening_(1.0 / step_sigma_) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(decay > 0.0 ? 2 : 1, 1);
  }

  /// Computes the weight of the step from `first` (ignored by the first of the process) to `second`.
  void renew(double first, double second) {
    constexpr double kFreedom = 4.0;
    const double step = (second - decay_ * first) / step_sigma_;
    const double weight = std::min(1.0, (kFreedom + 1.0) / (kFreedom + step * step));
    whitening_ = std::sqrt(weight) / step_sigma_;
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const std::size_t second = parameter_block_sizes().size() - 1;
    residuals[0] = whitening_ * (parameters[second][0] - (second > 0 ? decay_ * parameters[0][0] : 0.0));
    for (std::size_t i = 0; i <= second; ++i) {
      if (jacobians == nullptr || jacobians[i] == nullptr) continue;
      jacobians[i][0] = i == second ? whitening_ : -decay_ * whitening_;
    }
    return true;
  }

 private:
  double step_sigma_;
  double decay_;
  double whitening_;
};

}  // namespace lodestone
