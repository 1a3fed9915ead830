#include "estimators/baselines/state_cloud.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/imu/preintegration.h"
#include "core/imu/propagation.h"

namespace lodestone {

namespace {

Matrix3 about_vertical(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Vector3::UnitZ()).toRotationMatrix();
}

void make_symmetric(Matrix17& covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
}

/// The derivative of a step at `to` by the same step at `from`, before a turn about the vertical. φ is in body axes and
/// does not change; position, velocity and gravity turn. Near the vertical, the basis of the tangent plane of gravity
/// jumps from state to state.
Matrix17 turn_of_step(const Matrix3& turn, const Vector3& from_gravity, const Vector3& to_gravity) {
  Matrix17 result = Matrix17::Identity();
  result.block<3, 3>(tangent::position, tangent::position) = turn;
  result.block<3, 3>(tangent::velocity, tangent::velocity) = turn;
  result.block<2, 2>(tangent::gravity, tangent::gravity) =
      s2::basis(to_gravity).transpose() * turn * s2::basis(from_gravity);
  return result;
}

}  // namespace

double heading_rad(const Quaternion& R_map_imu) {
  return 2.0 * std::atan2(R_map_imu.z(), R_map_imu.w());
}

StateCloud::StateCloud(const NavState& state, const Matrix17& covariance)
    : states{{state, 0.0}}, nominal_(state), covariance_(covariance) {}

void StateCloud::set_nominal(const NavState& nominal) {
  const double turn = heading_rad(nominal.T_map_imu.rotation) - heading_rad(nominal_.T_map_imu.rotation);
  const Matrix17 transition = turn_of_step(about_vertical(turn), nominal_.gravity, nominal.gravity);
  covariance_ = (transition * covariance_ * transition.transpose()).eval();
  make_symmetric(covariance_);
  nominal_ = nominal;
}

Vector17 StateCloud::turned(const Vector17& step, const NavState& state) const {
  const double angle = heading_rad(state.T_map_imu.rotation) - heading_rad(nominal_.T_map_imu.rotation);
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  Vector17 result = step;
  for (const int offset : {tangent::position, tangent::velocity}) {
    result[offset] = c * step[offset] - s * step[offset + 1];
    result[offset + 1] = s * step[offset] + c * step[offset + 1];
  }
  Vector3 tilt = s2::basis(nominal_.gravity) * step.segment<2>(tangent::gravity);
  tilt.head<2>() = Eigen::Vector2d(c * tilt.x() - s * tilt.y(), s * tilt.x() + c * tilt.y());
  result.segment<2>(tangent::gravity) = s2::basis(state.gravity).transpose() * tilt;
  return result;
}

void StateCloud::propagate(std::span<const ImuSample> imu, const ImuNoise& noise) {
  const Preintegration increment(imu, nominal_.gyroscope_bias, nominal_.accelerometer_bias, noise);
  for (WeightedState& weighted : states) weighted.state = increment.predict(weighted.state);
  nominal_ = lodestone::propagate(nominal_, imu, noise, &covariance_);
}

void StateCloud::update(const std::function<Eigen::VectorXd(const NavState&)>& residual,
                        const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& noise) {
  const Eigen::MatrixXd innovation = jacobian * covariance_ * jacobian.transpose() + noise;
  const Eigen::LLT<Eigen::MatrixXd> factor(innovation);
  const Eigen::MatrixXd gain =
      covariance_ * jacobian.transpose() * factor.solve(Eigen::MatrixXd::Identity(jacobian.rows(), jacobian.rows()));
  for (WeightedState& weighted : states) {
    const Eigen::VectorXd found = residual(weighted.state);
    weighted.log_weight -= 0.5 * found.dot(factor.solve(found));
    weighted.state = weighted.state.boxplus(turned(-gain * found, weighted.state));
  }
  nominal_ = nominal_.boxplus(-gain * residual(nominal_));
  covariance_ = (covariance_ - gain * innovation * gain.transpose()).eval();
  make_symmetric(covariance_);
}

StateCloud::Regression field_regression(const StateCloud& cloud, bool with_height) {
  StateCloud::Regression result;
  const Eigen::Index dimensions = with_height ? 4 : 3;
  result.seen = Eigen::MatrixXd::Zero(dimensions, tangent::size);
  // R Exp(φ) = Exp(R φ) R: the heading changes by the vertical component of R φ.
  result.seen.block<1, 3>(0, tangent::rotation) =
      Vector3::UnitZ().transpose() * cloud.nominal().T_map_imu.rotation.toRotationMatrix();
  for (Eigen::Index i = 1; i < dimensions; ++i) result.seen(i, tangent::position + i - 1) = 1.0;
  const Eigen::MatrixXd crossed = cloud.covariance() * result.seen.transpose();
  result.covariance = result.seen * crossed;
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(result.covariance);
  const Eigen::VectorXd sigma = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  result.root = solver.eigenvectors() * sigma.asDiagonal();
  // Directions that are known exactly have no regression.
  const Eigen::VectorXd inverse = sigma.unaryExpr([](double s) { return s > 0.0 ? 1.0 / (s * s) : 0.0; });
  result.gain = crossed * solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
  return result;
}

NavState StateCloud::mean(std::span<const double> weights) const {
  Vector17 step = Vector17::Zero();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (weights[i] > 0.0) step += weights[i] * states[i].state.boxminus(nominal_);
  }
  return nominal_.boxplus(step);
}

Matrix17 StateCloud::spread(std::span<const double> weights, const NavState& about) const {
  Matrix17 sum = Matrix17::Zero();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (weights[i] <= 0.0) continue;
    const Vector17 step = states[i].state.boxminus(about);
    sum.selfadjointView<Eigen::Lower>().rankUpdate(step, weights[i]);
  }
  return sum.selfadjointView<Eigen::Lower>();
}

std::vector<double> StateCloud::weights() const {
  double largest = -std::numeric_limits<double>::infinity();
  for (const WeightedState& weighted : states) largest = std::max(largest, weighted.log_weight);
  std::vector<double> result;
  double sum = 0.0;
  for (const WeightedState& weighted : states) {
    result.push_back(std::exp(weighted.log_weight - largest));
    sum += result.back();
  }
  for (double& weight : result) weight /= sum;
  return result;
}

void StateCloud::replace_covariance(const Regression& regression, const Eigen::MatrixXd& posterior) {
  const Eigen::MatrixXd& gain = regression.gain;
  covariance_ = (covariance_ - gain * (regression.covariance - posterior) * gain.transpose()).eval();
  make_symmetric(covariance_);
}

}  // namespace lodestone
