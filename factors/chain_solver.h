#pragma once

#include <span>
#include <vector>

#include "factors/chain_system.h"
#include "factors/window_block.h"

namespace lodestone {

/// Variables and factors of a window, as the solver sees them.
struct ChainVariables {
  std::vector<WindowBlock*> poses;    ///< of the keyframes, in order of time
  std::vector<WindowBlock*> motions;  ///< as many
  std::vector<WindowBlock*> shared;   ///< gravity, biases: what several keyframes touch
};

/// Gauss-Newton on a chain, damped where a step fails (Levenberg and Marquardt). The factors are Ceres cost functions;
/// a block that `ChainVariables` does not name is held constant. Made for a solve and thrown away.
class ChainSolver {
 public:
  /// Throws std::logic_error where a factor joins keyframes that are not neighbours.
  ChainSolver(ChainVariables variables, std::span<const WindowFactor* const> factors);

  /// Moves the variables to the minimum of ½ Σ r²; returns the steps taken. Ends with a step that lowers the cost by
  /// less than a tenth of a sigma would, after which nothing of note is left.
  int minimize(int max_iterations);

  /// Pose covariances (φ, p) at the current values. Throws std::runtime_error where the information is not positive.
  std::vector<Matrix6> pose_covariances(std::span<const std::size_t> keyframes);

 private:
  struct Place {
    const WindowFactor* factor;
    std::vector<int> columns;  // of each of its blocks in the system's rows; −1: constant
    std::size_t keyframe = 0;
    bool second = false;
    int used = 0;
  };
  double residual_cost();
  double linearize();
  void move(const std::vector<double>& step);
  std::vector<WindowBlock*> all() const;

  ChainVariables variables_;
  std::vector<Place> places_;
  ChainSystem system_;
  std::vector<double> rows_;
  std::vector<double> residual_;
  std::vector<double> ambient_;
};

}  // namespace lodestone
