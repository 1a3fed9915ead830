#pragma once

#include <span>
#include <vector>

#include "core/geometry/so3.h"
#include "factors/block_system.h"
#include "factors/damped_minimizer.h"

namespace lodestone {

/// Any factors over any variables as a least-squares problem, factorized in the order in which the variables are given: what
/// a whole log needs. The factors are Ceres cost functions, evaluated in parallel and summed in order; a block that is not
/// among the variables is held constant.
class BlockSolver final : public LeastSquaresProblem {
 public:
  BlockSolver(std::vector<WindowBlock*> variables, std::span<const WindowFactor* const> factors);

  double linearize() override;
  double residual_cost() override;
  bool factorize(double damping) override { return system_.factorize(damping); }
  void step(std::vector<double>& result) const override { system_.step(result); }
  const std::vector<WindowBlock*>& variables() const override { return variables_; }

  /// Covariances of all pose variables (φ, p) at the current values, in their order. Throws std::runtime_error where the
  /// information is not positive.
  std::vector<Matrix6> pose_covariances();

 private:
  /// A factor with the places of its variables; those held constant are left out.
  struct Place {
    const WindowFactor* factor;
    BlockSystem::Clique clique;
    std::vector<bool> constant;  // one a block of the factor
  };
  static std::vector<Place> places(const std::vector<WindowBlock*>& variables,
                                   std::span<const WindowFactor* const> factors);
  static std::vector<BlockSystem::Clique> cliques(const std::vector<Place>& places);

  std::vector<WindowBlock*> variables_;
  std::vector<Place> places_;
  BlockSystem system_;
};

}  // namespace lodestone
