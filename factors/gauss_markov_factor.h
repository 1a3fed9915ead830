#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cmath>

namespace lodestone {

/// A Gauss-Markov process with the stationary covariance Σ: r = W (second − decay · first) / √(1 − decay²), Wᵀ W = Σ⁻¹.
/// Parameters: two blocks of the same size; or only the second, if it is the first of the process: r = W second.
class GaussMarkovFactor final : public ceres::CostFunction {
 public:
  /// `root`: lower triangle L, L Lᵀ = Σ, invertible. `decay`: in [0, 1); 0 for one block.
  GaussMarkovFactor(const Eigen::Matrix<double, 6, 6>& root, double decay)
      : whitening_(root.triangularView<Eigen::Lower>().solve(Eigen::Matrix<double, 6, 6>::Identity()) /
                   std::sqrt(1.0 - decay * decay)),
        decay_(decay) {
    set_num_residuals(6);
    mutable_parameter_block_sizes()->assign(decay > 0.0 ? 2 : 1, 6);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    using Vector = Eigen::Matrix<double, 6, 1>;
    const std::size_t second = parameter_block_sizes().size() - 1;
    Vector difference = Eigen::Map<const Vector>(parameters[second]);
    if (second > 0) difference -= decay_ * Eigen::Map<const Vector>(parameters[0]);
    Eigen::Map<Vector>{residuals} = whitening_ * difference;
    for (std::size_t i = 0; i <= second; ++i) {
      if (jacobians == nullptr || jacobians[i] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>{jacobians[i]} =
          i == second ? whitening_ : (-decay_ * whitening_).eval();
    }
    return true;
  }

 private:
  Eigen::Matrix<double, 6, 6> whitening_;
  double decay_;
};

}  // namespace lodestone
