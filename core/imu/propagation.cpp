#include "core/imu/propagation.h"

#include "core/imu/integration.h"

namespace lodestone {

namespace {

void propagate_covariance(const NavState& state, const ImuInterval& interval, const ImuNoise& noise,
                          Matrix17& covariance) {
  const double dt = interval.duration_s;
  const Matrix3 rotation = state.T_map_imu.rotation.toRotationMatrix();
  const Vector3 turn = dt * interval.angular_velocity;
  const Matrix3 half_rotation = rotation * so3::exp(0.5 * turn).toRotationMatrix();
  // Orientation error at the start, and half of the gyroscope bias' turn, act on velocity and position.
  const Matrix3 acceleration_by_rotation = -rotation * so3::hat(so3::exp(0.5 * turn) * interval.linear_acceleration);
  const Matrix3 turn_by_bias = -dt * so3::right_jacobian(turn);

  Matrix17 transition = Matrix17::Identity();
  using namespace tangent;
  transition.block<3, 3>(tangent::rotation, tangent::rotation) = so3::exp(-turn).toRotationMatrix();
  transition.block<3, 3>(tangent::rotation, gyroscope_bias) = turn_by_bias;
  transition.block<3, 3>(position, velocity) = dt * Matrix3::Identity();
  transition.block<3, 3>(position, tangent::rotation) = 0.5 * dt * dt * acceleration_by_rotation;
  transition.block<3, 3>(position, accelerometer_bias) = -0.5 * dt * dt * half_rotation;
  transition.block<3, 3>(velocity, tangent::rotation) = dt * acceleration_by_rotation;
  transition.block<3, 3>(velocity, gyroscope_bias) =
      0.5 * dt * dt * half_rotation * so3::hat(interval.linear_acceleration);
  transition.block<3, 3>(velocity, accelerometer_bias) = -dt * half_rotation;
  const Eigen::Matrix<double, 3, 2> gravity_step = s2::boxplus_jacobian(state.gravity);
  transition.block<3, 2>(position, gravity) = 0.5 * dt * dt * gravity_step;
  transition.block<3, 2>(velocity, gravity) = dt * gravity_step;

  covariance = (transition * covariance * transition.transpose()).eval();
  const auto add = [&](int offset, double density) {
    covariance.diagonal().segment<3>(offset).array() += density * density * dt;
  };
  add(tangent::rotation, noise.gyroscope_noise_density);
  add(velocity, noise.accelerometer_noise_density);
  add(gyroscope_bias, noise.gyroscope_bias_random_walk);
  add(accelerometer_bias, noise.accelerometer_bias_random_walk);
}

}  // namespace

NavState propagate(const NavState& start, std::span<const ImuSample> samples, const ImuNoise& noise,
                   Matrix17* covariance) {
  NavState state = start;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const ImuInterval interval =
        make_interval(samples[i - 1], samples[i], state.gyroscope_bias, state.accelerometer_bias);
    if (interval.duration_s <= 0.0) continue;
    if (covariance != nullptr) propagate_covariance(state, interval, noise, *covariance);
    integrate(interval, state.gravity, 1.0, state.T_map_imu, state.velocity);
  }
  if (covariance != nullptr) *covariance = (0.5 * (*covariance + covariance->transpose())).eval();
  return state;
}

}  // namespace lodestone
