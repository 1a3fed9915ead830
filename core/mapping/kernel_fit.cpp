#include "core/mapping/kernel_fit.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <stdexcept>

#include "core/mapping/quasi_newton.h"

namespace lodestone {
namespace {

using Vector = Eigen::Vector3d;  // logarithms of signal sigma, length scale, noise sigma

constexpr int max_evaluations = 60;
constexpr double tolerance = 1e-3;  // nats: far below what distinguishes two kernels

KernelParameters parameters_of(const Vector& logarithms, const KernelParameters& fixed) {
  KernelParameters result = fixed;
  result.signal_sigma = std::exp(logarithms[0]);
  result.length_scale_m = std::exp(logarithms[1]);
  result.noise_sigma = std::exp(logarithms[2]);
  return result;
}

}  // namespace

KernelFit fit_kernel(const std::vector<GaussianProcessData>& sets, const KernelParameters& start,
                     const KernelBounds& bounds) {
  if (sets.empty()) throw std::invalid_argument("fitting a kernel needs a data set");
  const Vector lower(std::log(bounds.min_sigma), std::log(bounds.min_length_scale_m), std::log(bounds.min_sigma));
  const Vector upper(std::log(bounds.max_sigma), std::log(bounds.max_length_scale_m), std::log(bounds.max_sigma));
  std::vector<Vector> starts;
  for (const double factor : {1.0, 0.35, 3.0}) {
    starts.emplace_back(std::log(start.signal_sigma), std::log(start.length_scale_m * factor), std::log(start.noise_sigma));
  }

  // The negative log likelihood of all sets and its gradient, summed in the order of the sets.
  std::vector<double> values(sets.size());
  std::vector<Vector> gradients(sets.size());
  const auto evaluate = [&](const Vector& logarithms, Vector& gradient) {
    const KernelParameters candidate = parameters_of(logarithms, start);
    tbb::parallel_for(std::size_t{0}, sets.size(), [&](std::size_t i) {
      values[i] = log_marginal_likelihood(sets[i], candidate, &gradients[i]);
    });
    double value = 0.0;
    gradient.setZero();
    for (std::size_t i = 0; i < sets.size(); ++i) {
      value -= values[i];
      gradient -= gradients[i];
    }
    return value;
  };
  // The likelihood's curvature grows with the number of points; half of it is a good first guess for a sigma.
  double points = 0.0;
  for (const GaussianProcessData& set : sets) points += static_cast<double>(set.values.size());
  const BoundedMinimum<3> found =
      minimize_within<3>(starts, lower, upper, 0.5 * points, tolerance, max_evaluations, evaluate);
  return {parameters_of(found.point, start), -found.value, found.evaluations, found.converged};
}

}  // namespace lodestone
