#pragma once

#include <cstddef>
#include <vector>

#include "core/mapping/quasi_newton.h"
#include "core/parallel.h"

namespace lodestone {

/// The logarithms of a kernel's parameters, between `lower` and `upper`, under which several sets of data are most
/// likely together, from the best of `starts`. `likelihood(set, logarithms, gradient)` gives the log marginal
/// likelihood of a set and its gradient; sets are worked on at the same time and summed in their order. `values`: how
/// many numbers all sets hold. The minimum's value is the negative log likelihood.
template <int Size, class Set, class Likelihood>
BoundedMinimum<Size> most_likely(const std::vector<Set>& sets,
                                 const std::vector<Eigen::Matrix<double, Size, 1>>& starts,
                                 const Eigen::Matrix<double, Size, 1>& lower,
                                 const Eigen::Matrix<double, Size, 1>& upper, double values, double tolerance_nats,
                                 int max_evaluations, Likelihood likelihood) {
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
  // The likelihood's curvature grows with the number of values; half of it is a good first guess for a sigma.
  return minimize_within<Size>(starts, lower, upper, 0.5 * values, tolerance_nats, max_evaluations, evaluate);
}

}  // namespace lodestone
