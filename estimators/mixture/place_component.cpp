#include "estimators/mixture/place_component.h"

#include <cmath>

namespace lodestone {

namespace {

constexpr double kOffsetWalk_ut_sqrt_s = 0.02;  ///< as in the smoother

}  // namespace

void PlaceComponent::move(const Eigen::VectorXd& delta) {
  state = state.boxplus(delta.head<tangent::size>());
  offsets_ut += delta.tail(offsets_ut.size());
}

Eigen::VectorXd step_between(const PlaceComponent& from, const PlaceComponent& to) {
  Eigen::VectorXd step(tangent::size + from.offsets_ut.size());
  step << to.state.boxminus(from.state), to.offsets_ut - from.offsets_ut;
  return step;
}

PlaceComponent merged_place(std::span<const PlaceComponent* const> members) {
  const PlaceComponent& first = *members.front();
  if (members.size() == 1) return first;
  const Eigen::Index size = first.covariance.cols();
  std::vector<Eigen::VectorXd> steps;
  std::vector<double> weights;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
  double sum = 0.0;
  for (const PlaceComponent* member : members) {
    steps.push_back(step_between(first, *member));
    weights.push_back(std::exp(member->log_weight - first.log_weight));
    mean += weights.back() * steps.back();
    sum += weights.back();
  }
  mean /= sum;
  PlaceComponent result{first.state, first.offsets_ut, Eigen::MatrixXd::Zero(size, size),
                        first.log_weight + std::log(sum), first.parent};
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Eigen::VectorXd apart = steps[i] - mean;
    result.covariance += weights[i] / sum * (members[i]->covariance + apart.lazyProduct(apart.transpose()));
  }
  result.move(mean);
  return result;
}

void predict_place(const Preintegration& increment, const ImuNoise& noise, PlaceComponent& component,
                   Eigen::MatrixXd& crossed) {
  const PlaceTransition transition = place_transition(increment, component.state, noise);
  const auto moves = transition.by_state.topRows<9>();  // the rest of F is the identity
  Eigen::MatrixXd& P = component.covariance;
  crossed = P;
  crossed.topRows<9>() = moves.lazyProduct(P.topRows<tangent::size>());
  P.topRows<9>() = crossed.topRows<9>();
  P.leftCols<9>() = crossed.leftCols<tangent::size>().lazyProduct(moves.transpose());
  P.topLeftCorner<tangent::size, tangent::size>() += transition.noise;
  P.diagonal().tail(component.offsets_ut.size()).array() += std::pow(kOffsetWalk_ut_sqrt_s, 2) * increment.duration_s();
  component.state = increment.predict(component.state);
}

PlaceTransition place_transition(const Preintegration& increment, const NavState& before, const ImuNoise& noise) {
  const Preintegration::Increment moved =
      increment.corrected(before.gyroscope_bias, before.accelerometer_bias, increment.axes());
  const Matrix3 R = before.T_map_imu.rotation.toRotationMatrix();
  const double dt = increment.duration_s();
  const Eigen::Matrix<double, 3, 2> gravity_step = s2::boxplus_jacobian(before.gravity);
  using namespace tangent;
  PlaceTransition result;
  Matrix17& F = result.by_state;
  F.setIdentity();
  F.block<3, 3>(tangent::rotation, tangent::rotation) = moved.rotation.conjugate().toRotationMatrix();
  F.block<3, 3>(tangent::rotation, gyroscope_bias) = increment.rotation_by_gyroscope_bias();
  F.block<3, 3>(position, tangent::rotation) = -R * so3::hat(moved.position);
  F.block<3, 3>(position, velocity) = dt * Matrix3::Identity();
  F.block<3, 3>(position, gyroscope_bias) = R * increment.position_by_gyroscope_bias();
  F.block<3, 3>(position, accelerometer_bias) = R * increment.position_by_accelerometer_bias();
  F.block<3, 2>(position, gravity) = 0.5 * dt * dt * gravity_step;
  F.block<3, 3>(velocity, tangent::rotation) = -R * so3::hat(moved.velocity);
  F.block<3, 3>(velocity, gyroscope_bias) = R * increment.velocity_by_gyroscope_bias();
  F.block<3, 3>(velocity, accelerometer_bias) = R * increment.velocity_by_accelerometer_bias();
  F.block<3, 2>(velocity, gravity) = dt * gravity_step;

  Matrix9 turned = Matrix9::Identity();
  turned.block<3, 3>(3, 3) = turned.block<3, 3>(6, 6) = R;
  result.noise.setZero();
  result.noise.topLeftCorner<9, 9>() = turned * increment.covariance() * turned.transpose();
  result.noise.diagonal().segment<3>(gyroscope_bias).setConstant(std::pow(noise.gyroscope_bias_random_walk, 2) * dt);
  result.noise.diagonal()
      .segment<3>(accelerometer_bias)
      .setConstant(std::pow(noise.accelerometer_bias_random_walk, 2) * dt);
  return result;
}

}  // namespace lodestone
