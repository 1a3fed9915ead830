#include "estimators/ieskf/iterated_update.h"

#include <Eigen/Cholesky>

namespace lodestone {

UpdatedState iterated_update(const NavState& prior, const Matrix17& covariance,
                             const std::function<StateEvidence(const NavState&)>& evidence,
                             const IteratedUpdateLimits& limits) {
  const Matrix17 prior_information = covariance.llt().solve(Matrix17::Identity());
  UpdatedState result{prior, covariance, 0};
  for (int iteration = 0; iteration < limits.max_iterations; ++iteration) {
    const StateEvidence measured = evidence(result.state);
    const Vector17 moved = result.state.boxminus(prior);
    Matrix17 difference = Matrix17::Identity();
    difference.block<3, 3>(tangent::rotation, tangent::rotation) =
        so3::right_jacobian_inverse(moved.segment<3>(tangent::rotation));
    difference.block<2, 2>(tangent::gravity, tangent::gravity) =
        s2::boxminus_jacobian(result.state.gravity, prior.gravity);
    Matrix17 information = difference.transpose() * prior_information * difference;
    Vector17 gradient = difference.transpose() * (prior_information * moved);
    information += measured.information;
    gradient += measured.gradient;
    const Eigen::LDLT<Matrix17> factor(information);
    const Vector17 step = factor.solve(-gradient);
    result.state = result.state.boxplus(step);
    result.covariance = factor.solve(Matrix17::Identity());
    ++result.iterations;
    if (step.segment<3>(tangent::position).norm() < limits.converged_m &&
        step.segment<3>(tangent::rotation).norm() < limits.converged_rad) {
      break;
    }
  }
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  return result;
}

}  // namespace lodestone
