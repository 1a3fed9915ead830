#include "core/mapping/kernel_fit.h"

#include <cmath>
#include <stdexcept>

#include "core/mapping/likelihood_maximum.h"

namespace lodestone {
namespace {

using Vector = Eigen::Vector3d;  // logarithms of signal sigma, length scale, noise sigma

constexpr int max_evaluations = 60;
constexpr double tolerance = 1e-3;  // nats: far below a significant difference of two kernels

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
  if (sets.empty()) throw std::invalid_argument("fit_kernel: expected at least one data set");
  const Vector lower(std::log(bounds.min_sigma), std::log(bounds.min_length_scale_m), std::log(bounds.min_sigma));
  const Vector upper(std::log(bounds.max_sigma), std::log(bounds.max_length_scale_m), std::log(bounds.max_sigma));
  std::vector<Vector> starts;
  for (const double factor : {1.0, 0.35, 3.0}) {
    starts.emplace_back(std::log(start.signal_sigma), std::log(start.length_scale_m * factor),
                        std::log(start.noise_sigma));
  }

  double points = 0.0;
  for (const GaussianProcessData& set : sets) points += static_cast<double>(set.values.size());
  const auto likelihood = [&](const GaussianProcessData& set, const Vector& logarithms, Vector* gradient) {
    return log_marginal_likelihood(set, parameters_of(logarithms, start), gradient);
  };
  const BoundedMinimum<3> found =
      maximize_likelihood<3>(sets, starts, lower, upper, points, tolerance, max_evaluations, likelihood);
  return {parameters_of(found.point, start), -found.value, found.evaluations, found.converged};
}

}  // namespace lodestone
