#include "estimators/baselines/continuous_time/motion_update.h"

#include <Eigen/Cholesky>

namespace lodestone {

namespace {

constexpr double kMotionConverged = 1e-3;  // rad, m, m/s, rad/s, m/s²

}  // namespace

MotionUpdate update_motion(const MotionState& prior, const Matrix15& covariance,
                           const std::function<MotionEvidence(const MotionState&)>& evidence, int max_iterations) {
  const Matrix15 prior_information = covariance.llt().solve(Matrix15::Identity());
  MotionUpdate result{prior, covariance, 0};
  while (result.iterations < max_iterations) {
    const MotionEvidence measured = evidence(result.state);
    const Vector15 moved = result.state.boxminus(prior);
    Matrix15 difference = Matrix15::Identity();
    difference.topLeftCorner<3, 3>() = so3::right_jacobian_inverse(moved.head<3>());
    const Matrix15 information = difference.transpose() * prior_information * difference + measured.information;
    const Vector15 gradient = difference.transpose() * (prior_information * moved) + measured.gradient;
    const Eigen::LDLT<Matrix15> factor(information);
    const Vector15 step = factor.solve(-gradient);
    result.state = result.state.boxplus(step);
    result.covariance = factor.solve(Matrix15::Identity());
    ++result.iterations;
    if (step.cwiseAbs().maxCoeff() < kMotionConverged) break;
  }
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  return result;
}

}  // namespace lodestone
