#pragma once

#include <cstddef>
#include <vector>

#include "core/mapping/quasi_newton.h"
#include "core/parallel.h"

namespace lodestone {

/// Maximizes the summed log marginal likelihood of several data sets over the logarithms of a kernel's parameters,
/// between `lower` and `upper`, from the best of `starts`. `likelihood(set, logarithms, gradient)` gives a set's log
/// likelihood and its gradient. Sets run in parallel and are summed in order. `values`: number of values of all sets.
/// The minimum's value is the negative log likelihood.
template <int Size, class Set, class Likelihood>
BoundedMinimum<Size> maximize_likelihood(const std::vector<Set>& sets,
                                         const std::vector<Eigen::Matrix<double, Size, 1>>& starts,
                                         const Eigen::Matrix<double, Size, 1>& lower,
                                         const Eigen::Matrix<double, Size, 1>& upper, double values,
                                         double tolerance_nats, int max_evaluations, Likelihood likelihood) {
  using Vector = Eigen::Matrix<double, Size, 1>;
  std::vector<double> of_set(sets.size());
  std::vector<Vector> gradients(sets.size());
  const auto evaluate = [&](const Vector& logarithms, Vector& gradient) {
    parallel_for(std::size_t{0}, sets.size(),
                 [&](std::size_t i) { of_set[i] = likelihood(sets[i], logarithms, &gradients[i]); });
    double value = 0.0;
    gradient.setZero();
    for (std::size_t i = 0; i < sets.size(); ++i) {
      value -= of_set[i];
      gradient -= gradients[i];
    }
    return value;
  };
  // The likelihood's curvature grows with the number of values. Half of that number is a good initial value for a
  // sigma.
  return minimize_within<Size>(starts, lower, upper, 0.5 * values, tolerance_nats, max_evaluations, evaluate);
}

}  // namespace lodestone
