#pragma once

#include <span>
#include <vector>

#include "factors/chain_system.h"
#include "factors/damped_minimizer.h"
#include "factors/window_block.h"

namespace lodestone {

/// Variables and factors of a window, as the solver sees them.
struct ChainVariables {
  std::vector<WindowBlock*> poses;    ///< of the keyframes, in order of time
  std::vector<WindowBlock*> motions;  ///< as many
  std::vector<WindowBlock*> shared;   ///< gravity, biases: what several keyframes touch
};

/// A window as a least-squares problem over a chain. The factors are Ceres cost functions; a block that `ChainVariables` does not name is held constant. Made for a solve and thrown away.
class ChainSolver final : public LeastSquaresProblem {
 public:
  /// Throws std::logic_error where a factor joins keyframes that are not neighbours.
  ChainSolver(ChainVariables variables, std::span<const WindowFactor* const> factors);

  /// Pose covariances (φ, p) at the current values. Throws std::runtime_error where the information is not positive.
  std::vector<Matrix6> pose_covariances(std::span<const std::size_t> keyframes);

  /// Variance of a shared variable (its place among them), of the last pose_covariances.
  double shared_variance(int index) const { return system_.shared_variance(index); }

  double linearize() override;
  double residual_cost() override;
  bool factorize(double damping) override { return system_.factorize(damping); }
  void step(std::vector<double>& result) const override { system_.step(result); }
  const std::vector<WindowBlock*>& variables() const override { return all_; }

 private:
  struct Place {
    const WindowFactor* factor;
    std::vector<int> columns;  // of each of its blocks in the system's rows; −1: constant
    std::size_t keyframe = 0;
    bool second = false;
    int used = 0;
  };

  ChainVariables variables_;
  std::vector<WindowBlock*> all_;  // in the order of a step
  std::vector<Place> places_;
  ChainSystem system_;
  std::vector<double> rows_;
  std::vector<double> residual_;
  std::vector<double> ambient_;
};

}  // namespace lodestone
