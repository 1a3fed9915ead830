#include "factors/damped_minimizer.h"

#include <algorithm>

namespace lodestone {

namespace {

constexpr double kLeastDamping = 1e-10;
constexpr double kLeastDecrease = 5e-3;  // of ½ Σ r²: a tenth of a sigma in any one direction

}  // namespace

int minimize(LeastSquaresProblem& problem, int max_iterations) {
  const std::vector<WindowBlock*>& blocks = problem.variables();
  std::vector<std::vector<double>> before(blocks.size());
  std::vector<double> step;
  double damping = kLeastDamping;
  double cost = problem.linearize();
  int iterations = 0;
  while (iterations < max_iterations) {
    ++iterations;
    bool better = false;
    double moved = cost;
    if (problem.factorize(damping)) {
      problem.step(step);
      const double* delta = step.data();
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        before[i] = blocks[i]->values;
        move(*blocks[i], delta);
        delta += blocks[i]->tangent_size();
      }
      moved = problem.residual_cost();
      better = moved < cost;
      if (!better) {
        // Ceres and others hold the addresses of the values.
        for (std::size_t i = 0; i < blocks.size(); ++i)
          std::copy(before[i].begin(), before[i].end(), blocks[i]->values.begin());
        // At the minimum rounding decides.
        if (moved - cost < kLeastDecrease) break;
      }
    }
    if (!better) {
      damping = std::max(1e-6, 100.0 * damping);
      if (damping > 1e6) break;
      continue;
    }
    const bool done = cost - moved < kLeastDecrease;
    cost = moved;
    damping = std::max(kLeastDamping, 0.01 * damping);
    if (done || iterations == max_iterations) break;
    problem.linearize();
  }
  return iterations;
}

}  // namespace lodestone
