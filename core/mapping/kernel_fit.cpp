#include "core/mapping/kernel_fit.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <stdexcept>

namespace lodestone {
namespace {

using Vector = Eigen::Vector3d;  // logarithms of signal sigma, length scale, noise sigma
using Matrix = Eigen::Matrix3d;

constexpr int max_evaluations = 60;
constexpr double tolerance = 1e-3;  // nats: far below what distinguishes two kernels

/// The negative log likelihood of all sets and its gradient, summed in the order of the sets.
class Objective {
 public:
  Objective(const std::vector<GaussianProcessData>& sets, const KernelParameters& fixed, const KernelBounds& bounds)
      : sets_(sets), fixed_(fixed), values_(sets.size()), gradients_(sets.size()) {
    lower_ << std::log(bounds.min_sigma), std::log(bounds.min_length_scale_m), std::log(bounds.min_sigma);
    upper_ << std::log(bounds.max_sigma), std::log(bounds.max_length_scale_m), std::log(bounds.max_sigma);
  }

  Vector clamp(const Vector& logarithms) const { return logarithms.cwiseMax(lower_).cwiseMin(upper_); }

  KernelParameters parameters(const Vector& logarithms) const {
    KernelParameters result = fixed_;
    result.signal_sigma = std::exp(logarithms[0]);
    result.length_scale_m = std::exp(logarithms[1]);
    result.noise_sigma = std::exp(logarithms[2]);
    return result;
  }

  double evaluate(const Vector& logarithms, Vector& gradient) {
    ++evaluations_;
    const KernelParameters candidate = parameters(logarithms);
    tbb::parallel_for(std::size_t{0}, sets_.size(), [&](std::size_t i) {
      values_[i] = log_marginal_likelihood(sets_[i], candidate, &gradients_[i]);
    });
    double value = 0.0;
    gradient.setZero();
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      value -= values_[i];
      gradient -= gradients_[i];
    }
    return value;
  }

  /// Where a bound stops the descent, the gradient counts as zero.
  Vector projected(const Vector& logarithms, Vector gradient) const {
    for (int i = 0; i < 3; ++i) {
      if ((logarithms[i] <= lower_[i] && gradient[i] > 0.0) || (logarithms[i] >= upper_[i] && gradient[i] < 0.0)) {
        gradient[i] = 0.0;
      }
    }
    return gradient;
  }

  int evaluations() const { return evaluations_; }

 private:
  const std::vector<GaussianProcessData>& sets_;
  KernelParameters fixed_;
  Vector lower_;
  Vector upper_;
  std::vector<double> values_;
  std::vector<Vector> gradients_;
  int evaluations_ = 0;
};

Vector logarithms_of(const KernelParameters& parameters) {
  return {std::log(parameters.signal_sigma), std::log(parameters.length_scale_m), std::log(parameters.noise_sigma)};
}

}  // namespace

KernelFit fit_kernel(const std::vector<GaussianProcessData>& sets, const KernelParameters& start,
                     const KernelBounds& bounds) {
  if (sets.empty()) throw std::invalid_argument("fitting a kernel needs a data set");
  Objective objective(sets, start, bounds);

  Vector point = objective.clamp(logarithms_of(start));
  Vector gradient;
  double value = objective.evaluate(point, gradient);
  for (const double factor : {0.35, 3.0}) {
    KernelParameters other = start;
    other.length_scale_m *= factor;
    const Vector candidate = objective.clamp(logarithms_of(other));
    Vector candidate_gradient;
    const double candidate_value = objective.evaluate(candidate, candidate_gradient);
    if (candidate_value < value) {
      point = candidate;
      value = candidate_value;
      gradient = candidate_gradient;
    }
  }

  KernelFit fit;
  // The likelihood's curvature grows with the number of points; half of it is a good first guess for a sigma.
  double points = 0.0;
  for (const GaussianProcessData& set : sets) points += static_cast<double>(set.values.size());
  const Matrix first_inverse_hessian = Matrix::Identity() * (2.0 / points);
  Matrix inverse_hessian = first_inverse_hessian;
  bool fresh = true;  // the Hessian is the first guess: a failed line search then means the end
  while (objective.evaluations() < max_evaluations) {
    const Vector projected = objective.projected(point, gradient);
    Vector direction = -inverse_hessian * projected;
    for (int i = 0; i < 3; ++i) {
      if (projected[i] == 0.0) direction[i] = 0.0;
    }
    if (direction.dot(projected) > -tolerance * 1e-3) {
      fit.converged = true;
      break;
    }
    const double longest = direction.cwiseAbs().maxCoeff();
    if (longest > 1.0) direction /= longest;  // at most a factor e a step

    bool moved = false;
    for (double step = 1.0; step > 1e-4 && objective.evaluations() < max_evaluations; step *= 0.4) {
      const Vector next = objective.clamp(point + step * direction);
      Vector next_gradient;
      const double next_value = objective.evaluate(next, next_gradient);
      if (!(next_value <= value + 1e-4 * gradient.dot(next - point))) continue;
      const Vector change = next - point;
      const Vector turn = next_gradient - gradient;
      const double curvature = change.dot(turn);
      const double decrease = value - next_value;
      if (curvature > 1e-12) {  // BFGS update of the inverse Hessian (Nocedal & Wright, eq. 6.17)
        const Matrix left = Matrix::Identity() - change * turn.transpose() / curvature;
        inverse_hessian = left * inverse_hessian * left.transpose() + change * change.transpose() / curvature;
        fresh = false;
      }
      point = next;
      value = next_value;
      gradient = next_gradient;
      moved = true;
      fit.converged = decrease < tolerance;
      break;
    }
    if (fit.converged) break;
    if (!moved) {
      if (fresh) break;
      inverse_hessian = first_inverse_hessian;
      fresh = true;
    }
  }
  fit.parameters = objective.parameters(point);
  fit.log_likelihood = -value;
  fit.evaluations = objective.evaluations();
  return fit;
}

}  // namespace lodestone
