#pragma once

#include <ceres/cost_function.h>

#include <algorithm>
#include <cmath>

namespace lodestone {

/// Slip of the wheels as a Gauss-Markov process with the stationary σ: r = (second − decay · first) / s, s = σ √(1 −
/// decay²), or the size of a detected jump if that is larger. Parameters: two blocks of one number; or only the second,
/// if it is the first of the process: r = second / σ.
class SlipFactor final : public ceres::CostFunction {
 public:
  /// `decay`: in [0, 1); 0 for one block. `jump`: sigma of a jump at this step; 0: none (docs/design/049-wheels.md).
  SlipFactor(double sigma, double decay, double jump)
      : whitening_(1.0 / std::max(sigma * std::sqrt(1.0 - decay * decay), jump)), decay_(decay) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(decay > 0.0 ? 2 : 1, 1);
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
  double whitening_;
  double decay_;
};

}  // namespace lodestone
