#pragma once

#include <Eigen/Core>
#include <vector>

namespace lodestone {

/// Result of a minimization.
template <int size>
struct BoundedMinimum {
  Eigen::Matrix<double, size, 1> point;
  double value = 0.0;
  int evaluations = 0;
  bool converged = false;
};

/// Minimizes a smooth function within bounds: quasi-Newton (BFGS, Nocedal & Wright 2006, chapter 6) from the best of
/// `starts` (clamped to the bounds; at least one). The variables are logarithms of kernel parameters; a step changes
/// them by at most 1. `evaluate(point, gradient)` returns the value and sets the gradient. `curvature`: initial guess
/// of the second derivatives. Stops if a step gains less than `tolerance`, or after `max_evaluations`.
template <int size, class Evaluate>
BoundedMinimum<size> minimize_within(const std::vector<Eigen::Matrix<double, size, 1>>& starts,
                                     const Eigen::Matrix<double, size, 1>& lower,
                                     const Eigen::Matrix<double, size, 1>& upper, double curvature, double tolerance,
                                     int max_evaluations, Evaluate&& evaluate) {
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;
  BoundedMinimum<size> result;
  const auto clamp = [&](const Vector& point) -> Vector { return point.cwiseMax(lower).cwiseMin(upper); };
  const auto counted = [&](const Vector& point, Vector& gradient) {
    ++result.evaluations;
    return evaluate(point, gradient);
  };
  // A component of the gradient that points out of the bounds counts as zero.
  const auto projected_gradient = [&](const Vector& point, Vector gradient) {
    for (int i = 0; i < size; ++i) {
      if ((point[i] <= lower[i] && gradient[i] > 0.0) || (point[i] >= upper[i] && gradient[i] < 0.0)) gradient[i] = 0.0;
    }
    return gradient;
  };

  Vector point = clamp(starts.front());
  Vector gradient;
  double value = counted(point, gradient);
  for (std::size_t i = 1; i < starts.size(); ++i) {
    const Vector candidate = clamp(starts[i]);
    Vector candidate_gradient;
    const double candidate_value = counted(candidate, candidate_gradient);
    if (candidate_value < value) {
      point = candidate;
      value = candidate_value;
      gradient = candidate_gradient;
    }
  }

  const Matrix first_inverse_hessian = Matrix::Identity() * (1.0 / curvature);
  Matrix inverse_hessian = first_inverse_hessian;
  bool fresh = true;  // the Hessian is the initial guess; a failed line search then ends the search
  while (result.evaluations < max_evaluations) {
    const Vector projected = projected_gradient(point, gradient);
    Vector direction = -inverse_hessian * projected;
    for (int i = 0; i < size; ++i) {
      if (projected[i] == 0.0) direction[i] = 0.0;
    }
    if (direction.dot(projected) > -tolerance * 1e-3) {
      result.converged = true;
      break;
    }
    const double longest = direction.cwiseAbs().maxCoeff();
    if (longest > 1.0) direction /= longest;

    bool moved = false;
    for (double step = 1.0; step > 1e-4 && result.evaluations < max_evaluations; step *= 0.4) {
      const Vector next = clamp(point + step * direction);
      Vector next_gradient;
      const double next_value = counted(next, next_gradient);
      if (!(next_value <= value + 1e-4 * gradient.dot(next - point))) continue;
      const Vector change = next - point;
      const Vector turn = next_gradient - gradient;
      const double product = change.dot(turn);
      const double decrease = value - next_value;
      if (product > 1e-12) {  // the inverse Hessian's update, eq. (6.17)
        const Matrix left = Matrix::Identity() - change * turn.transpose() / product;
        inverse_hessian = left * inverse_hessian * left.transpose() + change * change.transpose() / product;
        fresh = false;
      }
      point = next;
      value = next_value;
      gradient = next_gradient;
      moved = true;
      result.converged = decrease < tolerance;
      break;
    }
    if (result.converged) break;
    if (!moved) {
      if (fresh) break;
      inverse_hessian = first_inverse_hessian;
      fresh = true;
    }
  }
  result.point = point;
  result.value = value;
  return result;
}

}  // namespace lodestone
