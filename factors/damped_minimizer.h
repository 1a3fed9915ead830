#pragma once

#include <vector>

#include "factors/window_block.h"

namespace lodestone {

/// A least-squares problem as its minimizer sees it: ½ Σ r² over some variables, by its normal equations.
class LeastSquaresProblem {
 public:
  virtual ~LeastSquaresProblem() = default;

  /// Normal equations at the current values; returns ½ Σ r².
  virtual double linearize() = 0;

  /// ½ Σ r² at the current values.
  virtual double residual_cost() = 0;

  /// Factorizes the normal equations with their diagonal raised by the share `damping`; false where they are not positive.
  virtual bool factorize(double damping) = 0;

  /// The Gauss-Newton step of the last factorization: tangents of `variables` in their order.
  virtual void step(std::vector<double>& result) const = 0;

  /// In the order of the step.
  virtual const std::vector<WindowBlock*>& variables() const = 0;
};

/// Gauss-Newton, damped where a step fails (Levenberg and Marquardt). Moves the variables to the minimum; returns the steps
/// taken. Ends with a step that lowers the cost by less than a tenth of a sigma would, after which nothing of note is left.
int minimize(LeastSquaresProblem& problem, int max_iterations);

}  // namespace lodestone
